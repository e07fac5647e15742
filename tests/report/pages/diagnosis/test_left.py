# SPDX-License-Identifier: BSD-3-Clause
"""What the completed model leaves."""

from types import SimpleNamespace

import numpy as np
import pytest

from skidyn.report import summarize


@pytest.fixture
def diagnosis(fakes):
    made = fakes.make_diagnosis()
    size = np.full(3, 0.125)
    made.parts = SimpleNamespace(
        sensor_noise=size,
        position_noise=2 * size,
        predictable=3 * size,
        left=5 * size,
        inflation=np.ones(3),
        material=np.zeros(3, dtype=bool),
        coloured=False,
    )
    return made


def test_the_error_is_taken_apart(diagnosis):
    (first, *_) = summarize(diagnosis)["left"]
    assert first["torque_noise"] == 0.125 and first["position_noise"] == 0.25
    assert first["predictable"] == 0.375 and first["remainder"] == 0.625
    assert (first["joint"], first["unit"]) == (1, "N m")


def test_without_parts_the_noise_is_all_that_is_said(diagnosis_page):
    assert "The remaining error of every joint is at the noise level." in diagnosis_page["left"]
