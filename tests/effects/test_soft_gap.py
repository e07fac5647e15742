# SPDX-License-Identifier: BSD-3-Clause
"""A gap with soft flanks, of which the encoder shows the motor's side."""

import numpy as np
import pytest

from skidyn.effects import get_effect

GAP = 0.02


@pytest.fixture
def crossed(signals, robot):
    """Motion of the motor, position of the motor relative to the link, and the torque."""
    load = robot.inverse_dynamics(signals.q, signals.dq, signals.ddq)
    torque = 0.2 * float(np.sqrt(np.mean(load[:, 1] ** 2)))
    position, speed, acceleration = (np.zeros_like(load) for _ in range(3))
    for rows in signals.segments:
        clock = signals.clock[rows]
        position[rows, 1] = GAP / 2 * np.tanh(load[rows, 1] / torque)
        speed[rows] = np.gradient(position[rows], clock, axis=0)
        acceleration[rows] = np.gradient(speed[rows], clock, axis=0)
    q, dq = signals.q + position, signals.dq + speed
    ddq = signals.ddq + acceleration
    logged = robot.inverse_dynamics(q, dq, ddq)
    motor = signals.with_(q=q, dq=dq, ddq=ddq, load=logged, inertial_parameters=None)
    return motor, position[:, 1], torque


def test_the_link_is_where_its_own_load_presses_it(crossed):
    motor, position, torque = crossed

    found, *_ = get_effect("backlash").moves(motor, 1, gap=GAP, torque=torque)

    # The load of the logged motion leaps back and forth at every crossing.
    naive = GAP / 2 * np.tanh(motor.load[:, 1] / torque)
    assert np.std(found - position) < 0.15 * np.std(position)
    assert np.std(found - position) < 0.5 * np.std(naive - position)


def test_soft_flanks_are_tried_only_where_the_load_closes_the_gap_on_both_sides(crossed):
    motor, _, torque = crossed
    effect = get_effect("backlash")

    soft = [shape for shape in effect.grid(motor, [1]) if "torque" in shape]
    pulled = motor.with_(load=motor.load + 2 * np.abs(motor.load).max())
    one_sided = [shape for shape in effect.grid(pulled, [1]) if "torque" in shape]

    assert [shape["torque"] for shape in soft] == pytest.approx(3 * [torque], rel=0.5)
    assert not one_sided


def test_a_soft_gap_has_its_torque_among_the_parameters():
    effect = get_effect("backlash")

    soft = effect.parameters(np.array([1.5]), {"gap": 0.01, "torque": 0.3})

    assert soft == pytest.approx({"gap": 0.015, "torque": 0.3})
    assert effect.parameters(np.array([1.5]), {"gap": 0.01}) == pytest.approx({"gap": 0.015})
