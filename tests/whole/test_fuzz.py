# SPDX-License-Identifier: BSD-3-Clause
"""A bounded run of benchmarks/scale/fuzz.py: damaged inputs are read or refused, never a crash."""

import importlib.util
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2] / "benchmarks" / "scale" / "fuzz.py"
_specification = importlib.util.spec_from_file_location("fuzz", SOURCE)
fuzz = importlib.util.module_from_spec(_specification)
_specification.loader.exec_module(fuzz)


@pytest.mark.parametrize("name", fuzz.TARGETS)
def test_damaged_inputs_are_read_or_refused(name):
    if name == "model":
        pytest.importorskip("skops.io")
    count = 4 if name in ("mat", "feather") else 40  # these are read in a process of their own
    _, accepted, crashes = fuzz.try_inputs(name, count)
    assert not crashes, crashes[0][1]
    assert accepted or name == "report"  # its seed names files that are not there
