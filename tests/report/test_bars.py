# SPDX-License-Identifier: BSD-3-Clause
import pytest

from skidyn.report._bars import scale_of


def test_a_bar_is_as_long_as_its_error():
    scale = scale_of([4.0, 1.0])
    assert scale.place(4.0) == pytest.approx(4 * scale.place(1.0), abs=0.2)
    assert scale.ticks[0] == 1 and max(scale.ticks) == 4


def test_very_different_joints_share_a_logarithmic_scale():
    scale = scale_of([300.0, 1.0])
    assert 0 < scale.place(1.0) < scale.place(10.0) < scale.place(100.0) < scale.place(300.0) <= 100
    assert scale.ticks == [1, 10, 100]


def test_what_is_not_known_has_no_bar():
    assert scale_of([None, float("nan")]).place(None) == 0.0
