# SPDX-License-Identifier: BSD-3-Clause
"""Springs and bodies of the suite."""

import pytest


@pytest.mark.slow
def test_it_stands_out_of_the_noise(planar_case):
    truth = planar_case("one", "spring").make().truth
    (effect,) = truth["effects"]
    assert effect["kind"] == "spring" and truth["detectable"]
    assert set(effect["joints"]) <= {1, 2}
    assert "viscous" in truth["base_model"]
