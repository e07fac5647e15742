# SPDX-License-Identifier: BSD-3-Clause
"""Friction that grows with the torque the transmission carries."""

import numpy as np

from skidyn.datasets import load_planar_arm
from skidyn.effects import get_effect


def test_it_is_the_size_of_the_load_against_the_motion(signals, columns_of):
    column = columns_of("load_dependent_friction", signals)[:, 0]
    moving = np.abs(signals.dq[:, 0]) > 0.05
    expected = np.abs(signals.load[:, 0]) * np.sign(signals.dq[:, 0])
    np.testing.assert_allclose(column[moving], expected[moving])
    assert np.all(np.abs(column) <= np.abs(signals.load[:, 0]))


def test_a_gear_that_loses_only_while_it_drives(signals, columns_of):
    plain = columns_of("load_dependent_friction", signals)[:, 0]
    driving = columns_of("load_dependent_friction", signals, driving=1.0)[:, 0]
    drives = signals.load[:, 0] * signals.dq[:, 0] > 0
    np.testing.assert_array_equal(driving, np.where(drives, plain, 0.0))
    partly = columns_of("load_dependent_friction", signals, backdriven=0.4)[:, 0]
    np.testing.assert_array_equal(partly, np.where(drives, plain, 0.4 * plain))


def test_a_loss_that_grows_with_load_and_speed(signals, columns_of):
    loaded = signals.with_(load=3.0 * np.ones_like(signals.q))

    friction = columns_of("load_dependent_friction", loaded, viscous=1.0)

    np.testing.assert_allclose(friction[:, 0], 3.0 * loaded.dq[:, 0])


def test_the_drive_carries_its_own_friction_as_well(signals, columns_of):
    shape = {"friction": 0.4, "damping": 0.2}
    own = signals.with_(load=signals.load + 0.4 * signals.sign + 0.2 * signals.dq)

    friction = columns_of("load_dependent_friction", signals, **shape)

    np.testing.assert_allclose(friction, columns_of("load_dependent_friction", own))


def test_a_preloaded_gear_feels_what_exceeds_its_threshold(signals, columns_of):
    beyond = np.maximum(0.0, np.abs(signals.load[:, 0]) - 0.3) * signals.sign[:, 0]
    found = columns_of("load_dependent_friction", signals, threshold=0.3)
    np.testing.assert_allclose(found[:, 0], beyond, atol=1e-12)


def test_one_flank_feels_load_of_one_sign(signals, columns_of):
    load = signals.load[:, 0]
    found = [columns_of("load_dependent_friction", signals, side=s)[:, 0] for s in (1.0, -1.0)]
    np.testing.assert_allclose(sum(found), columns_of("load_dependent_friction", signals)[:, 0])
    assert np.all(found[0][load < 0] == 0) and np.all(found[1][load > 0] == 0)


def test_its_own_friction_needs_a_load_that_moves_the_joint(signals):
    effect, shape = get_effect("load_dependent_friction"), {"friction": 0.4, "damping": 0.2}
    heavy = signals.with_(load=10.0 * np.ones_like(signals.q))
    light = signals.with_(load=0.1 * np.ones_like(signals.q))

    assert effect.admissible(heavy, [0], shape) and effect.admissible(light, [0], {})
    assert not effect.admissible(light, [0], shape)


def test_a_rotor_that_accelerates_loads_the_gear_with_its_inertia(signals):
    effect = get_effect("load_dependent_friction")
    columns = effect.columns(signals, 0, inertia=0.5)
    load = signals.load[:, 0] + 0.5 * signals.ddq[:, 0]
    np.testing.assert_allclose(columns[:, 0], np.abs(load) * signals.sign[:, 0])
    assert any(set(shape) == {"inertia"} for shape in effect.grid(signals, (0,)))
    assert (effect.units()["inertia"], effect.units(prismatic=True)["inertia"]) == ("kg m^2", "kg")


def test_only_the_weight_of_the_described_bodies_may_count(signals, columns_of):
    robot = load_planar_arm()
    moved = signals.with_(robot=robot)
    rest = np.zeros_like(moved.q)

    friction = columns_of("load_dependent_friction", moved, gravity=1.0)

    weight = np.abs(robot.inverse_dynamics(moved.q, rest, rest)[:, 0])
    np.testing.assert_allclose(friction[:, 0], weight * moved.sign[:, 0])
