# SPDX-License-Identifier: BSD-3-Clause
"""Simulate and prepare logs of a suite: ``python _make.py FOLDER SEED CONTENTS NUMBER ...``."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

from _prepare import prepare

from skidyn.datasets import hidden_effect_suite


def main() -> None:
    warnings.simplefilter("ignore")
    folder, seed, contents = Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3].split(",")
    numbers = [int(word) for word in sys.argv[4:]]
    suite = hidden_effect_suite(seed, max(numbers) + 1, contents=contents)
    for number in numbers:
        case = suite[number]
        if not (folder / "truth" / f"{case.name}.json").exists():
            case.write(folder)
        prepare(folder / "cases" / case.name)


if __name__ == "__main__":
    main()
