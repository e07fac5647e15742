# SPDX-License-Identifier: BSD-3-Clause
"""Importing skidyn stays light: what is heavy is loaded when it is first used."""

import importlib
import pkgutil
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import skidyn

HEAVY = ("matplotlib", "pandas", "pytorch_kinematics", "sklearn", "skorch", "torch")


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
    """A third of the time until the first answer, each."""
    loaded = modules_after("import skidyn.logs, skidyn.evidence, skidyn.measurement")
    slow = {f"scipy.{name}" for name in ("optimize", "signal", "stats")}
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
