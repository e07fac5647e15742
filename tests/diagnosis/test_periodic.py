# SPDX-License-Identifier: BSD-3-Clause
"""Ripple with harmonics, over the position of a joint."""

import numpy as np
import pytest

from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


def arches(q):
    """Pins of which six pass over the travel, and the waves per rad."""
    waves = 6 * 2 * np.pi / np.ptp(q)
    return np.abs(np.sin(waves * q / 2)) - 2 / np.pi, waves


def test_pins_are_a_ripple_and_no_function_of_the_position(without_friction):
    arm = without_friction
    torque = arm.torque.copy()
    wave, waves = arches(arm.q[:, 1])
    torque[:, 1] += 0.6 * arm.size[1] * wave

    (finding,) = diagnose(RBDRegressor(arm.robot, ()), arm.X, torque, checks=()).findings

    assert (finding.kind, finding.joints) == ("torque_ripple", (2,))
    assert finding.parameters["N"]["value"] == pytest.approx(waves, rel=0.01)
    # amplitudes of the Fourier series
    sizes = [finding.parameters[name]["value"] for name in ("A", "A2")]
    size = 0.6 * arm.size[1] * 4 / np.pi
    assert sizes == pytest.approx([size / 3, size / 15], rel=0.1)


@pytest.mark.slow
def test_pins_beside_friction_of_their_joint_are_a_ripple(without_friction):
    arm = without_friction
    torque = arm.torque.copy()
    wave, _ = arches(arm.q[:, 1])
    speed = arm.X["dq2"].to_numpy()
    torque[:, 1] += 0.6 * arm.size[1] * wave + 0.3 * arm.size[1] * np.tanh(3 * speed)

    findings = diagnose(RBDRegressor(arm.robot, ()), arm.X, torque, checks=()).findings

    assert "torque_ripple" in {f.kind for f in findings}
    assert {f.joints for f in findings} == {(2,)}


def test_two_waves_of_unrelated_lengths_are_one_ripple(without_friction):
    arm = without_friction
    torque, unit = arm.torque.copy(), 2 * np.pi / np.ptp(arm.q[:, 1])
    waves = [7.0 * unit, 4.3 * unit]
    size = 0.4 * arm.size[1]
    torque[:, 1] += size * (np.sin(waves[0] * arm.q[:, 1]) + 0.6 * np.sin(waves[1] * arm.q[:, 1]))

    (finding,) = diagnose(RBDRegressor(arm.robot, ()), arm.X, torque, checks=()).findings

    told = {name: value["value"] for name, value in finding.parameters.items()}
    assert (finding.kind, finding.joints) == ("torque_ripple", (2,))
    assert [told["N"], told["second"]] == pytest.approx(waves, rel=0.01)
    assert [told["A"], told["A2"]] == pytest.approx([size, 0.6 * size], rel=0.05)
