# SPDX-License-Identifier: BSD-3-Clause
"""Loads that differ from recording to recording, beside which mistakes are found."""

import numpy as np
import pytest

from skidyn.logs import check_log
from skidyn.measurement._loads import by_recording, n_loads, span


@pytest.mark.parametrize("count, loads", [(1, 0), (2, 4), (5, 16), (16, 60), (17, 0)])
def test_coefficients_of_loads_by_the_number_of_recordings(count, loads):
    number = np.repeat(np.arange(count), 3)
    assert n_loads(number) == loads
    columns = by_recording(np.ones((len(number), 4)), number)
    assert columns.shape == (len(number), loads)
    assert not columns[number == 0].any()


def test_columns_that_span_the_same():
    columns = np.random.default_rng(0).normal(size=(30, 3))
    basis = span(np.column_stack([columns, columns[:, 0], np.zeros(30)]))
    assert basis.shape == (30, 3)
    np.testing.assert_allclose(basis @ (basis.T @ columns), columns, atol=1e-9)


def test_loads_are_no_mistake(loaded):
    assert not [s for s in loaded.checks if s.certainty != "noted"]


@pytest.mark.slow
@pytest.mark.parametrize("joint", [3, 5])
def test_a_zero_is_found_beside_them(joint, loaded):
    frame = loaded.frame.assign(**{f"q{joint}": loaded.frame[f"q{joint}"] + 0.9})
    (one,) = [s for s in check_log(frame, loaded.robot).checks if s.certainty != "noted"]
    assert one.check == "reading" and one.joints == (joint,)
    name, _, angle = one.remedy.option.partition("=")
    assert name == f"--zero q{joint}" and float(angle) == pytest.approx(0.9, abs=0.03)
