# SPDX-License-Identifier: BSD-3-Clause
"""Nameless functions can take the form of any smooth torque of their signals."""

import numpy as np

from skidyn.effects import FrictionTransformer, Term, get_effect


def test_a_push_during_motion_is_a_function_of_position_and_velocity(signals, left_by):
    q, dq = signals.q[:, 0], signals.dq[:, 0]
    shape = {"low": q.min(), "high": q.max()}
    columns = Term("function_of_position_and_velocity", (1,), shape).torque_columns(signals)[0]
    assert left_by(columns, np.abs(dq) * (q - 0.2)) < 1e-9
    assert left_by(columns, q) > 0.3


def test_friction_over_position_vanishes_at_rest(signals):
    rest = signals.with_(dq=np.zeros_like(signals.dq))
    columns = Term("friction_over_position", (1,)).torque_columns(rest)[0]
    assert (columns == 0).all()


def test_friction_over_acceleration_opposes_the_motion_and_grows_with_its_size(signals):
    (shape,) = get_effect("friction_over_acceleration").grid(signals, (0,))
    columns = Term("friction_over_acceleration", (1,), shape).torque_columns(signals)[0]
    size = np.abs(signals.ddq[:, 0]) / shape["size"]
    expected = np.column_stack([size, size**2]) * signals.sign[:, [0]]
    np.testing.assert_allclose(columns, expected)
    assert get_effect("friction_over_acceleration").variables(0, shape) == ("dq1", "ddq1")


def test_friction_over_the_position_of_a_long_slider_is_smooth(signals, left_by):
    slides = signals.with_(prismatic=np.ones(signals.n_joints, dtype=bool))
    friction = slides.dq[:, 0] * (slides.q[:, 1] - slides.q[:, 1].mean()) ** 2
    effect = get_effect("friction_over_other_position")
    (shape,) = (s for s in effect.grid(slides, (0,)) if s["other"] == 1)
    columns = effect.torque_columns(slides, (0,), **shape)[0]
    assert left_by(np.column_stack([columns, slides.dq[:, 0]]), friction) < 0.05


def test_friction_over_position_is_a_term_without_a_shape(signals):
    transformer = FrictionTransformer(["friction_over_position"], n_joints=signals.n_joints)
    X = np.hstack([signals.q, signals.dq, signals.ddq])
    assert len(transformer.fit_transform(X)) == len(X)


def test_a_drag_of_another_joint_may_be_quadratic(signals, left_by):
    """A hose that another joint drags through the air."""
    wind = signals.dq[:, 1] * np.abs(signals.dq[:, 1])
    effect = get_effect("function_of_two_velocities")
    assert left_by(effect.torque_columns(signals, (0,), other=1)[0], wind) < 1e-9
