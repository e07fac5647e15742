# SPDX-License-Identifier: BSD-3-Clause
"""Always reports that nothing is missing; the score of this answer is the reference for others."""

PACKAGE = "numpy"


def answer(log, robot) -> dict:
    return {"verdict": "complete", "effects": []}
