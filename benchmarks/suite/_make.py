# SPDX-License-Identifier: BSD-3-Clause
"""Simulate logs of a suite and prepare them: ``python _make.py FOLDER SEED NUMBER ...``."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

from _prepare import prepare

from skidyn.datasets import hidden_effect_suite


def main() -> None:
    warnings.simplefilter("ignore")
    folder, seed, numbers = Path(sys.argv[1]), int(sys.argv[2]), [int(w) for w in sys.argv[3:]]
    suite = hidden_effect_suite(seed, max(numbers) + 1)
    for number in numbers:
        case = suite[number]
        if not (folder / "truth" / f"{case.name}.json").exists():
            case.write(folder)
        prepare(folder / "cases" / case.name)


if __name__ == "__main__":
    main()
