# SPDX-License-Identifier: BSD-3-Clause
"""Faults of the measurement in the suite."""


def test_it_stands_out_of_the_noise(planar_case):
    truth = planar_case("one", "offset").make().truth
    (effect,) = truth["effects"]
    assert effect["kind"] == "offset" and truth["detectable"]
    assert set(effect["joints"]) <= {1, 2}
