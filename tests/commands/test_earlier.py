# SPDX-License-Identifier: BSD-3-Clause
"""Stored diagnoses that later commands use instead of repeating them."""

from __future__ import annotations

import numpy as np
import pytest

import skidyn.diagnosis
from skidyn import cli
from skidyn._commands import _earlier


@pytest.fixture
def twice(diagnosed, capsys):
    """Output and files of a command with the stored diagnoses, and without them."""
    stored = diagnosed / ".skidyn"

    def run(words, *files):
        capsys.readouterr()
        assert cli.main(list(map(str, words))) == cli.DONE
        printed = capsys.readouterr()
        return printed.out, printed.err, *(file.read_bytes() for file in files)

    def both(words, *files):
        first = run(words, *files)
        hidden = stored.rename(diagnosed / "hidden")
        try:
            return first, run(words, *files)
        finally:
            hidden.rename(stored)

    return both


@pytest.fixture
def asked(monkeypatch):
    """The checks that every diagnosis is given, which is made as it is."""
    given, diagnose = [], skidyn.diagnosis.diagnose

    def noted(*args, **kw):
        given.append(kw["checks"])
        return diagnose(*args, **kw)

    monkeypatch.setattr(skidyn.diagnosis, "diagnose", noted)
    return given


def test_stored_diagnoses_are_compared_like_repeated_ones(diagnosed, tmp_path, twice, asked):
    pytest.importorskip("jinja2", reason="needs skidyn[report]")
    first, second = diagnosed / "report.json", tmp_path / "friction.json"
    words = ["diagnose", diagnosed / "log.csv", "--urdf", diagnosed / "arm.urdf", "--effects"]
    words += ["coulomb", "--model", "rigid_body,viscous", "--out", second]
    assert cli.main(list(map(str, words))) == cli.DONE
    asked.clear()
    pages = tmp_path / "page.html", tmp_path / "page.json"
    at_once, repeated = twice(["compare", first, second, "--html", pages[0]], *pages)
    assert at_once == repeated
    assert len(asked) == 2  # by the second command


def test_checks_of_a_log_are_not_repeated(diagnosed, twice, asked):
    words = ["add", "--from", diagnosed / "report.json", "--effect", "stribeck", "--joints", "2"]
    at_once, repeated = twice(words)
    assert at_once == repeated
    assert [checks is None for checks in asked] == [False, False, True, False]


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("kind", [float, bool, int])
def test_arrays_are_stored_exactly_and_in_their_order(order, kind):
    values = np.asarray(np.random.default_rng(0).normal(size=(5, 3)) * 9, dtype=kind, order=order)
    again = _earlier._unpacked(_earlier._packed(values))
    assert again.dtype == values.dtype and again.strides == values.strides
    np.testing.assert_array_equal(again, values)
    assert _earlier._unpacked(_earlier._packed(None)) is None
