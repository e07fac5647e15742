# SPDX-License-Identifier: BSD-3-Clause
"""Which of scikit-learn's checks every estimator passes, which it cannot, and why.

    python benchmarks/scikit_learn/checks.py

The tests run scikit-learn's common checks on every estimator
(``pytest -k test_scikit_learn_contract``), with the checks that cannot hold listed there with their
reasons; a listed check that holds is an error. This prints what they list, for the table in the
user guide.
"""

from __future__ import annotations

import importlib.util
import warnings
from pathlib import Path
from typing import Any

TESTS = Path(__file__).resolve().parents[2] / "tests"


def contract_tests() -> list[Any]:
    """Every (estimator, check, marks) of the tests."""
    found = []
    for path in sorted(TESTS.rglob("test_*.py")):
        if "def test_scikit_learn_contract" not in path.read_text(encoding="utf-8"):
            continue
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        for mark in module.test_scikit_learn_contract.pytestmark:
            found += list(mark.args[1])
    return found


def main() -> None:
    warnings.simplefilter("ignore")
    table: dict[str, list[Any]] = {}
    for entry in contract_tests():
        values = getattr(entry, "values", entry)
        marks = [mark for mark in getattr(entry, "marks", ()) if mark.name == "xfail"]
        estimator, check = values[0], values[1]
        kind = type(estimator)
        public = next((k for k in kind.__mro__ if k.__module__.startswith("skidyn.")), None)
        if public is None:  # the example of the guide
            continue
        key = f"{public.__name__}, {estimator!r}"
        row = table.setdefault(key, [public, kind is not public, 0, {}])
        row[2] += 1
        name = getattr(check, "func", check).__name__
        for mark in marks:
            row[3][name] = mark.kwargs["reason"]
    merged: dict[str, list[Any]] = {}
    for public, wrapped, count, failed in table.values():
        row = merged.setdefault(public.__name__, [public, wrapped, 0, {}])
        row[2], row[3] = max(row[2], count), row[3] | failed
    for name, (public, wrapped, count, failed) in sorted(merged.items()):
        package = public.__module__.partition("._")[0]
        reasons = [f"``{check}``: {reason}" for check, reason in sorted(failed.items())]
        if wrapped:
            reasons.append("columns taken in turn, since a robot fixes theirs")
        print(f"   * - :class:`~{package}.{name}`")
        print(f"     - {count}\n     - {len(failed)}\n     - {'; '.join(reasons)}".rstrip())


if __name__ == "__main__":
    main()
