# SPDX-License-Identifier: BSD-3-Clause
"""Faults of the measurement in the suite."""

import json

import pytest


@pytest.mark.slow
def test_it_stands_out_of_the_noise(written):
    truth = json.loads(written.truth.read_text())
    (effect,) = truth["effects"]
    assert effect["kind"] == "offset" and truth["detectable"]
    assert set(effect["joints"]) <= {1, 2}
