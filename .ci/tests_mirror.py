# SPDX-License-Identifier: BSD-3-Clause
"""How far the tests are the same tree as the sources, and use public names: prints what is not.

Usage: python .ci/tests_mirror.py [--list]

The modules of tests/whole are left out: they test the package as a whole.
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def place(path: Path, top: str) -> str:
    """Where a module stands, such as ``logs/read`` for skidyn/logs/_read.py and its tests."""
    *folders, name = path.relative_to(ROOT / top).with_suffix("").parts
    return "/".join(part.lstrip("_") for part in (*folders, name.removeprefix("test_")))


def private_imports(path: Path) -> set[str]:
    """Private modules and names of skidyn that a test imports."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "skidyn":
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [a.name for a in node.names if a.name.split(".")[0] == "skidyn"]
        else:
            continue
        found |= {n for n in names if any(p.startswith("_") for p in n.split(".")[1:])}
    return {name for name in found if not name.endswith("__")}


def told(names_of: dict[Path, set[str]]) -> set[str]:
    """A line for each module."""
    return {f"{path.relative_to(ROOT)}: {', '.join(sorted(n))}" for path, n in names_of.items()}


def offered() -> set[str]:
    """Private names that the ``__init__`` of a public package offers under the same name."""
    found = set()
    for path in (ROOT / "skidyn").rglob("__init__.py"):
        if any(part.startswith("_") for part in path.relative_to(ROOT).parts[:-1]):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def main() -> None:
    """Print the counts, and with --list the names."""
    sources = {
        place(path, "skidyn")
        for path in (ROOT / "skidyn").rglob("*.py")
        if not path.stem.startswith("__")
    }
    tests = sorted(p for p in (ROOT / "tests").rglob("test_*.py") if p.parent.name != "whole")
    tested = {place(path, "tests") for path in tests}
    private = {path: names for path in tests if (names := private_imports(path))}
    avoidable = {path: both for path, names in private.items() if (both := names & offered())}
    parts = {
        "sources with a test module of their name": sources & tested,
        "sources without": sources - tested,
        "test modules of no one source": tested - sources,
        "test modules that import private names": told(private),
        "of these, test modules that import names which a public package offers": told(avoidable),
    }
    print(f"{len(sources)} sources, {len(tests)} test modules")
    for what, names in parts.items():
        print(f"{len(names):4d} {what}")
        if "--list" in sys.argv:
            print("".join(f"       {name}\n" for name in sorted(names)), end="")


if __name__ == "__main__":
    main()
