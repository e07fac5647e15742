# SPDX-License-Identifier: BSD-3-Clause
"""Imports: what is heavy is loaded when it is first used, and no package is in a circle.

A package is a folder of ``skidyn``, and is used through what its ``__init__`` gives. The modules
beside the folders (``_columns``, ``_signals`` and so on) are the ground on which all packages
stand; the command line stands on all of them.
"""

import ast
import importlib
import pkgutil
import re
import subprocess
import sys
import tomllib
from collections import defaultdict
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import skidyn

HEAVY = ("matplotlib", "pandas", "pytorch_kinematics", "sklearn", "skorch", "torch")
SOURCE = Path(__file__).resolve().parents[2] / "skidyn"
PACKAGES = {path.parent.name for path in SOURCE.glob("*/__init__.py")} - {"_commands"}
GROUND, COMMANDS = "modules beside the packages", "command line"


def modules_after(statement: str) -> set[str]:
    """Names of the packages that a fresh interpreter has loaded after a statement.

    Of the packages inside another one, only those of SciPy.
    """
    names = "{'.'.join(m.split('.')[:1 + m.startswith('scipy.')]) for m in sys.modules}"
    code = f"{statement}; import sys; print(*sorted({names}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_skidyn_loads_nothing_heavy():
    assert not modules_after("import skidyn").intersection((*HEAVY, "numpy", "scipy"))


def test_physics_needs_neither_torch_nor_pictures_nor_tables():
    names = ("effects", "evidence", "identification", "diagnosis", "report")
    loaded = modules_after(f"import {', '.join(f'skidyn.{name}' for name in names)}")
    # scikit-learn loads pandas by itself where it is installed; what counts is what we add.
    loaded -= modules_after("import sklearn.base")
    assert not loaded.intersection({"matplotlib", "pandas", "skorch", "torch"})


def test_a_log_is_checked_without_scikit_learn_and_slow_parts_of_scipy():
    """A third of the time until the first answer, each; the fits load the linear algebra later."""
    loaded = modules_after("import skidyn.logs, skidyn.evidence, skidyn.measurement")
    parts = ("linalg", "optimize", "signal", "sparse", "stats")
    slow = {f"scipy.{name}" for name in parts}
    assert not loaded.intersection({*HEAVY, *slow})


def test_a_robot_and_its_torques_need_numpy_only():
    code = (
        "from skidyn.datasets import load_planar_arm; "
        "load_planar_arm().inverse_dynamics([[0, 0]], [[1, 1]], [[0, 0]])"
    )
    assert not modules_after(code).intersection((*HEAVY, "scipy"))


def test_submodules_are_loaded_on_first_use():
    assert skidyn.robots is importlib.import_module("skidyn.robots")


def test_every_package_is_reached_from_the_top():
    found = {m.name for m in pkgutil.iter_modules(skidyn.__path__) if m.ispkg}
    public = {n for n in found if getattr(importlib.import_module(f"skidyn.{n}"), "__all__", ())}
    # An import makes a package an attribute of skidyn, so that the hook itself has to be asked.
    for name in public - {"_commands"}:
        assert skidyn.__getattr__(name).__name__ == f"skidyn.{name}"


def test_every_module_can_be_imported():
    for module in pkgutil.walk_packages(skidyn.__path__, "skidyn."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)


def test_what_is_imported_without_an_extra_is_declared():
    """Top-level imports of third parties and pandas, which the README's loop needs."""
    with open(Path(skidyn.__file__).parents[1] / "pyproject.toml", "rb") as file:
        declared = tomllib.load(file)["project"]["dependencies"]
    names = {re.split(r"[<>=]", line)[0] for line in declared}
    assert {"pandas", "threadpoolctl"} <= names


def test_unknown_attribute_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'robotics'"):
        skidyn.robotics  # noqa: B018


def package_of(parts):
    """The package of a module, given by its name's parts after ``skidyn``."""
    if parts and parts[0] in ("cli", "__main__", "_commands"):
        return COMMANDS
    return parts[0] if parts and parts[0] in PACKAGES else GROUND


@pytest.fixture(scope="module")
def imports_within():
    """Each import of skidyn by skidyn: where it stands, its own package, and what it imports."""
    found = []
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
                found.append((where, package_of(parts), name.split(".")[1:], node in guarded))
    return found


def for_type_checks(tree):
    """Nodes that the type checker alone sees."""
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            yield from ast.walk(node)


def test_no_package_reaches_into_another(imports_within):
    private = [
        f"{where}: skidyn.{'.'.join(name)}"
        for where, own, name, _ in imports_within
        if package_of(name) not in (own, GROUND) and any(p.startswith("_") for p in name[1:])
    ]
    assert not private, "import from the package instead (its __init__ names what others may use)"


def test_packages_stand_on_each_other_without_circles(imports_within):
    below = defaultdict(set)
    for _, own, name, typing_only in imports_within:
        if not typing_only and package_of(name) != own:
            below[own].add(package_of(name))
    below[GROUND] -= {COMMANDS}  # python -m skidyn
    assert not below[GROUND], "what all packages stand on may use none of them"
    try:
        tuple(TopologicalSorter(below).static_order())
    except CycleError as error:
        raise AssertionError(f"packages import each other: {' -> '.join(error.args[1])}") from None
