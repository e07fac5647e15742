# SPDX-License-Identifier: BSD-3-Clause
"""Gaps with soft flanks and gears that stiffen, of which the encoder shows the motor's side."""

import numpy as np
import pytest

from skidyn.effects import get_effect

GAP = 0.02


def motor_of(signals, robot, ahead):
    """Motion of a motor that is ahead of its link under a load, and how far it is."""
    load = robot.inverse_dynamics(signals.q, signals.dq, signals.ddq)
    torque = 0.2 * float(np.sqrt(np.mean(load[:, 1] ** 2)))
    position, speed, acceleration = (np.zeros_like(load) for _ in range(3))
    for rows in signals.segments:
        clock = signals.clock[rows]
        position[rows, 1] = ahead(load[rows, 1] / torque)
        speed[rows] = np.gradient(position[rows], clock, axis=0)
        acceleration[rows] = np.gradient(speed[rows], clock, axis=0)
    q, dq = signals.q + position, signals.dq + speed
    ddq = signals.ddq + acceleration
    logged = robot.inverse_dynamics(q, dq, ddq)
    motor = signals.with_(q=q, dq=dq, ddq=ddq, load=logged, inertial_parameters=None)
    return motor, position[:, 1], torque


@pytest.fixture
def crossed(signals, robot):
    """Motion of the motor, position of the motor relative to the link, and the torque."""
    return motor_of(signals, robot, lambda load: GAP / 2 * np.tanh(load))


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


def test_a_link_behind_a_gear_that_stiffens_is_where_its_own_load_winds_it_up(signals, robot):
    motor, position, torque = motor_of(signals, robot, lambda load: 0.01 * np.arcsinh(load))
    effect = get_effect("joint_elasticity")
    inertia = effect.bounded(motor, [1], {}, 0.2)["inertia"]
    resonance = np.sqrt(torque / (0.01 * inertia)) / (2 * np.pi)

    wound_up, *_ = effect.moves(motor, 1, resonance=resonance, stiffening=torque)

    found = 0.01 / torque * wound_up
    assert np.std(found - position) < 0.15 * np.std(position)
    told = effect.parameters(np.array([0.5]), {"resonance": resonance, "stiffening": torque})
    assert told == pytest.approx({"K": 2.0, "resonance": resonance, "stiffening": torque})


def test_a_gear_that_stiffens_only_beyond_all_loads_is_a_spring(signals, robot):
    motor, *_ = motor_of(signals, robot, np.zeros_like)
    effect = get_effect("joint_elasticity")
    largest = np.abs(motor.load[:, 1]).max()

    assert sum("stiffening" in shape for shape in effect.grid(motor, [1])) == 3
    assert not effect.admissible(motor, [1], {"resonance": 10.0, "stiffening": 1.1 * largest})
