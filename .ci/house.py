# SPDX-License-Identifier: BSD-3-Clause
"""How large and how entangled the package is: prints the counts of one or several versions.

Usage: python .ci/house.py [CHECKOUT ...]

A checkout is the root of a version (``git worktree add`` makes one); this one by default. Private
imports are those that reach past the ``__init__`` of another package; circles are groups of
packages that import each other at run time.
"""

from __future__ import annotations

import ast
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

COMMANDS = {"cli", "__main__", "_commands"}


def imports(path: Path, root: Path) -> Iterator[tuple[list[str], bool]]:
    """Names of skidyn that a module imports, and whether only a type checker does."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    blocks = [n for n in ast.walk(tree) if isinstance(n, ast.If)]
    guarded = {
        id(inner)
        for block in blocks
        if getattr(block.test, "id", "") == "TYPE_CHECKING"
        for inner in ast.walk(block)
    }
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "skidyn":
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [a.name for a in node.names if a.name.startswith("skidyn.")]
        for name in names:
            yield name.split(".")[1:], id(node) in guarded


def circles(below: dict[str, set[str]]) -> list[set[str]]:
    """Groups of packages from each of which every other one of the group is reached."""

    def reached(start: str) -> set[str]:
        seen: set[str] = set()
        todo = [start]
        while todo:
            for name in below[todo.pop()] - seen:
                seen.add(name)
                todo.append(name)
        return seen

    reach = {name: reached(name) for name in list(below)}
    groups = [{other for other in reach if name in reach[other]} & reach[name] for name in reach]
    return [set(group) for group in {frozenset(group) for group in groups if len(group) > 1}]


def counts(root: Path) -> dict[str, str]:
    """What is printed of a version."""
    source = root / "skidyn"
    packages = {path.parent.name for path in source.glob("*/__init__.py")} - COMMANDS
    lines, private, below = {}, 0, defaultdict(set)
    for path in sorted(source.rglob("*.py")):
        parts = path.relative_to(source).with_suffix("").parts
        lines[path] = len(path.read_text(encoding="utf-8").splitlines())
        own = parts[0] if parts[0] in packages else ""
        for name, typing_only in imports(path, root):
            other = name[0] if name and name[0] in packages else ""
            if not other or other == own:
                continue
            private += any(part.startswith("_") for part in name[1:])
            if own and not typing_only:
                below[own].add(other)
                below[other]
    longest = max(lines, key=lambda path: lines[path])
    tests = list((root / "tests").rglob("test_*.py"))
    return {
        "lines of skidyn/": str(sum(lines.values())),
        "modules": str(len(lines)),
        "longest module": f"{lines[longest]} ({longest.relative_to(source)})",
        "packages": str(len(packages)),
        "private imports across packages": str(private),
        "circles of packages": str(len(circles(below))),
        "packages in circles": str(sum(map(len, circles(below)))),
        "test modules": str(len(tests)),
        "lines of tests/": str(sum(len(t.read_text("utf-8").splitlines()) for t in tests)),
    }


def main() -> None:
    """Print one column for every version."""
    roots = [Path(word) for word in sys.argv[1:]] or [Path(__file__).resolve().parents[1]]
    columns = [counts(root) for root in roots]
    for what in columns[0]:
        print(f"{what:<34}" + "".join(f"{column[what]:>40}" for column in columns))


if __name__ == "__main__":
    main()
