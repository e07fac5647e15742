# SPDX-License-Identifier: BSD-3-Clause
"""A log of the suite is simulated alike every time."""

import numpy as np
import pytest


@pytest.mark.slow
def test_a_log_comes_out_the_same_again(empty, planar_case):
    again = planar_case("nothing").make()
    np.testing.assert_array_equal(empty.frame.to_numpy(), again.frame.to_numpy())
