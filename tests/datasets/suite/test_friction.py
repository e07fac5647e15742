# SPDX-License-Identifier: BSD-3-Clause
"""Friction of the suite."""

import pytest


@pytest.mark.slow
def test_it_stands_out_of_the_noise(planar_case):
    truth = planar_case("one", "viscous").make().truth
    (effect,) = truth["effects"]
    assert effect["kind"] == "viscous" and truth["detectable"]
    assert effect["joints"] == [1, 2]  # all that the base model lacks
    assert "viscous" not in truth["base_model"]
