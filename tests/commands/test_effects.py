# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn effects``."""

from skidyn import cli


def test_effects_lists_the_catalogue(run):
    code, content = run("effects")
    assert code == cli.DONE
    assert content["dahl"]["title"]
    assert content["servo_current"]["coefficients"] == [["limit", "N m", 1]]
