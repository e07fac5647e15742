# SPDX-License-Identifier: BSD-3-Clause
"""Columns that follow a temperature."""

import numpy as np

from skidyn.effects import get_effect


def test_temperature(signals, columns_of):
    warm, v = signals.temperature[:, 1] - 30.0, signals.dq[:, 1]
    block = columns_of("temperature_friction", signals, 1)
    plain = np.column_stack([warm * v, warm * signals.sign[:, 1]])
    np.testing.assert_allclose(block, plain)
    curved = columns_of("temperature_friction", signals, 1, curved=1.0)
    np.testing.assert_allclose(curved, np.column_stack([plain, warm**2 * v]))
    ones = np.ones_like(warm)
    offset = columns_of("temperature_offset", signals, 1)
    np.testing.assert_allclose(offset, np.column_stack([warm, ones]))
    curved = columns_of("temperature_offset", signals, 1, curved=1.0)
    np.testing.assert_allclose(curved, np.column_stack([warm, warm**2, ones]))
    cold = signals.with_(temperature=None)
    assert "no temperature" in get_effect("temperature_friction").not_shown(cold, 0)


def test_what_levels_off_starts_with_the_same_slope(signals, columns_of):
    warm = signals.temperature[:, 0] - 30.0
    levelled = columns_of("temperature_offset", signals, levels_over=6.0)[:, 0]
    np.testing.assert_allclose(levelled, 6.0 * (1 - np.exp(-warm / 6.0)))
    assert np.all(levelled <= warm + 1e-12)


def test_friction_that_changed_at_once(signals):
    columns = get_effect("friction_drift").columns(signals, 0, since=3.0)
    later = signals.clock >= 3.0
    np.testing.assert_allclose(columns[:, 0], later * signals.dq[:, 0])
    np.testing.assert_allclose(columns[:, 1], later * signals.sign[:, 0])
    assert columns.shape[1] == 2


def test_friction_of_another_level_has_no_moment(signals):
    effect = get_effect("friction_drift")
    columns = effect.columns(signals, 0, level=1.0)
    np.testing.assert_allclose(columns, np.column_stack([signals.dq[:, 0], signals.sign[:, 0]]))
    assert effect.meaning({}) == ""
    assert "3 s" in effect.meaning({"since": {"value": 3.0, "unit": "s"}})


def test_an_inside_that_warms_before_its_housing_is_one_drift(signals):
    clock = signals.clock
    share = (clock - clock.min()) / np.ptp(clock)
    warm = 0.6 * np.exp(-share / 0.08) + 0.4 * np.exp(-share / 0.6)
    torque = warm * signals.sign[:, 0]
    effect = get_effect("friction_drift")
    shapes = [s for s in effect.grid(signals, (0,)) if "since" not in s]
    shapes += [s | {"time_constant": 0.45 * np.ptp(clock)} for s in shapes]
    left = []
    for shape in shapes:
        columns = effect.columns(signals, 0, **shape)
        columns = np.column_stack([columns, signals.sign[:, 0]])
        left.append(np.var(torque - columns @ np.linalg.lstsq(columns, torque, rcond=None)[0]))
    assert min(left) < 0.005 * np.var(warm)


def test_a_change_in_the_last_recording_alone_is_not_tried(signals):
    effect = get_effect("friction_drift")
    moments = [shape["since"] for shape in effect.grid(signals, (0,)) if "since" in shape]
    assert moments
    assert max(moments) < 3.0  # where the last of two begins
    assert not effect.admissible(signals, (0,), {"since": 3.0})


def test_an_offset_turns_at_a_temperature(signals, columns_of):
    own = signals.temperature[:, 0]
    knee = float(np.median(own))
    columns = columns_of("temperature_offset", signals, knee=knee)
    turned = np.column_stack([own - 30.0, np.maximum(own - knee, 0), np.ones_like(own)])
    np.testing.assert_allclose(columns, turned)
    effect = get_effect("temperature_offset")
    assert effect.admissible(signals, (0,), {"knee": knee})
    assert not effect.admissible(signals, (0,), {"knee": float(own.max())})
    tried = {shape["knee"] for shape in effect.grid(signals, (0,)) if "knee" in shape}
    assert len(tried) == 3 and own.min() < min(tried) < max(tried) < own.max()
