# SPDX-License-Identifier: BSD-3-Clause
"""The thresholds of the rule."""

import pytest

from skidyn.diagnosis import diagnose


def test_thresholds_of_another_kind_are_refused(spring_log, missing):
    with pytest.raises(ValueError, match=r"expected Settings"):
        diagnose(missing.base_model, spring_log.X, spring_log.y, settings={"level": 0.1})
