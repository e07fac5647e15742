# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of joints, as users write them."""

import numpy as np
import pytest

from skidyn._joint_numbers import joint_numbers
from skidyn.exceptions import SkidynError


@pytest.mark.parametrize("joints", [2, np.int64(2), [2], (2,), np.array([2]), {2}])
def test_one_joint_may_be_written_in_many_ways(joints):
    assert joint_numbers(joints) == [2]


@pytest.mark.parametrize("joints", ["elbow", ["elbow"], 1.5, [1.5], True])
def test_what_is_no_number_is_refused_with_an_example(joints):
    with pytest.raises(SkidynError, match=r"counted from 1.*joints=2, joints=\[1, 4\]"):
        joint_numbers(joints)
