# SPDX-License-Identifier: BSD-3-Clause
"""Torques without a name in the suite."""

import pytest


@pytest.mark.slow
def test_it_stands_out_of_the_noise(planar_case):
    truth = planar_case("nameless", "narrow_bump").make().truth
    (effect,) = truth["effects"]
    assert effect["kind"] == "unknown" and truth["detectable"]
    assert set(effect["joints"]) <= {1, 2}
