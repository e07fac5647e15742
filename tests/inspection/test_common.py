# SPDX-License-Identifier: BSD-3-Clause
"""What all pictures need."""

from types import SimpleNamespace

import pytest

from skidyn.exceptions import ColumnError
from skidyn.inspection import ErrorMapDisplay


def test_a_regressor_without_robot_needs_one(log):
    with pytest.raises(ColumnError, match="pass robot="):
        ErrorMapDisplay.from_estimator(SimpleNamespace(), log.X, log.y)
