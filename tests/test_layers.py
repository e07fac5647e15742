# SPDX-License-Identifier: BSD-3-Clause
"""The packages of skidyn: each is used through what its ``__init__`` gives, and none in a circle.

A package is a folder of ``skidyn``. The modules beside the folders (``_columns``, ``_signals`` and
so on) are the ground on which all packages stand; the command line stands on all of them.
"""

import ast
from collections import defaultdict
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1] / "skidyn"
PACKAGES = {path.parent.name for path in SOURCE.glob("*/__init__.py")} - {"_commands"}
GROUND, COMMANDS = "modules beside the packages", "command line"


def package_of(parts):
    """The package of a module, given by its name's parts after ``skidyn``."""
    if parts and parts[0] in ("cli", "__main__", "_commands"):
        return COMMANDS
    return parts[0] if parts and parts[0] in PACKAGES else GROUND


@cache
def imports():
    """Each import of skidyn by skidyn: where it stands, its own package, and what it imports."""
    return list(_imports())


def _imports():
    for path in sorted(SOURCE.rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        tree = ast.parse(path.read_text(encoding="utf-8"))
        guarded = set(for_type_checks(tree))
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("skidyn"):
                names = [f"{node.module}.{name.name}" for name in node.names]
            elif isinstance(node, ast.Import):
                names = [name.name for name in node.names if name.name.startswith("skidyn.")]
            else:
                continue
            for name in names:
                where = f"{path.relative_to(SOURCE.parent)}:{node.lineno}"
                yield where, package_of(parts), name.split(".")[1:], node in guarded


def for_type_checks(tree):
    """Nodes that the type checker alone sees."""
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            yield from ast.walk(node)


def test_no_package_reaches_into_another():
    private = [
        f"{where}: skidyn.{'.'.join(name)}"
        for where, own, name, _ in imports()
        if package_of(name) not in (own, GROUND) and any(p.startswith("_") for p in name[1:])
    ]
    assert not private, "import from the package instead (its __init__ names what others may use)"


def test_packages_stand_on_each_other_without_circles():
    below = defaultdict(set)
    for _, own, name, typing_only in imports():
        if not typing_only and package_of(name) != own:
            below[own].add(package_of(name))
    below[GROUND] -= {COMMANDS}  # python -m skidyn
    assert not below[GROUND], "what all packages stand on may use none of them"
    try:
        tuple(TopologicalSorter(below).static_order())
    except CycleError as error:
        raise AssertionError(f"packages import each other: {' -> '.join(error.args[1])}") from None
