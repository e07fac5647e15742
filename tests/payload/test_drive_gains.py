# SPDX-License-Identifier: BSD-3-Clause
"""Drive gains from currents and a load of known mass."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.logs import load_recording
from skidyn.payload import estimate_drive_gains
from skidyn.robots import Robot

FRICTION = ("viscous", "coulomb")
GAINS = np.array([14.0, 13.0, 11.0, 10.0, 12.0, 9.0])


@pytest.fixture(scope="module")
def currents():
    """Currents of a UR5 with and without a payload, and its mass and centre of mass."""
    log = make_hidden_effect_log(
        load_ur5(), "payload", base=FRICTION, n_trajectories=6, duration=8.0, random_state=3
    )
    frame = log.frame.assign(
        **{f"tau{j + 1}": log.frame[f"tau{j + 1}"] / g for j, g in enumerate(GAINS)}
    )
    carries = frame["trajectory"].isin(log.parameters["trajectories"])
    return log, frame[carries], frame[~carries]


@pytest.fixture(scope="module")
def found(currents):
    log, loaded, unloaded = currents
    return estimate_drive_gains(
        log.robot, loaded, unloaded, log.parameters["mass"], effects=FRICTION
    )


def test_gains_and_load(currents, found):
    np.testing.assert_allclose(found.gains[:5], GAINS[:5], rtol=0.03)
    np.testing.assert_allclose(found.com, currents[0].parameters["com"], atol=0.005)
    assert "proportional to the mass" in found.text and "N m/A" in found.text
    assert json.loads(json.dumps(found.to_dict()))["gains"] == list(found.gains)


def test_all_gains_scale_with_the_mass(currents, found):
    log, loaded, unloaded = currents
    other = estimate_drive_gains(
        log.robot, loaded, unloaded, 2 * log.parameters["mass"], effects=FRICTION
    )
    np.testing.assert_allclose(other.gains, 2 * found.gains, rtol=1e-3)


def test_corrects_gains_that_were_used_for_reading(currents, found):
    log, loaded, unloaded = currents
    wrong = np.array([10.0, 20, 10, 5, 10, 10])
    torques = {f"tau{j + 1}": g for j, g in enumerate(wrong)}
    scaled = [f.assign(**{c: f[c] * g for c, g in torques.items()}) for f in (loaded, unloaded)]
    other = estimate_drive_gains(
        log.robot, *scaled, log.parameters["mass"], drive_gains=wrong, effects=FRICTION
    )
    np.testing.assert_allclose(other.gains, found.gains, rtol=1e-4)
    np.testing.assert_allclose(other.factors * wrong, other.gains)
    assert "with which the runs were read" in other.text


def test_gain_of_one_recording_that_differs(currents, found):
    log, loaded, unloaded = currents
    assert found.by_recording.values.shape == (len(found.by_recording.names), 6)
    np.testing.assert_allclose(found.by_recording.values[:, 1:3], [GAINS[1:3]] * 6, rtol=0.03)
    first = loaded["trajectory"] == loaded["trajectory"].iloc[0]
    changed = loaded.assign(tau2=loaded["tau2"].where(~first, 1.05 * loaded["tau2"]))
    other = estimate_drive_gains(
        log.robot, changed, unloaded, log.parameters["mass"], effects=FRICTION
    )
    gains = other.by_recording.values[:, 1]
    assert gains[0] == pytest.approx(np.mean(gains[1:]) / 1.05, rel=0.02)
    assert other.by_recording.names[0] == "loaded 1"
    assert "In loaded 1, shoulder_lift_joint measures" in other.text
    assert "of what the other recordings" not in found.text


def test_known_centre_of_mass_narrows_the_intervals(currents, found):
    log, loaded, unloaded = currents
    truth = log.parameters
    other = estimate_drive_gains(
        log.robot, loaded, unloaded, truth["mass"], com=truth["com"], effects=FRICTION
    )
    np.testing.assert_allclose(other.com, truth["com"])
    np.testing.assert_allclose(other.gains[:5], GAINS[:5], rtol=0.03)


def test_errors_name_what_is_wrong(currents):
    log, loaded, unloaded = currents
    with pytest.raises(SkidynError, match="mass is -1"):
        estimate_drive_gains(log.robot, loaded, unloaded, -1)
    with pytest.raises(SkidynError, match="no run without the load"):
        estimate_drive_gains(log.robot, loaded, None, 1.0)
    with pytest.raises(SkidynError, match="needs 6 numbers"):
        estimate_drive_gains(log.robot, loaded, unloaded, 1.0, drive_gains=[1.0])


def test_real_gains(data_dir):
    """Five of six gains of a UR10e are 0.88 to 0.99 of the published set."""
    file = data_dir / "ur10e" / "ur10e_excitation.npz"
    published = np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        loaded, unloaded = (
            load_recording(file, run=run, drive_gains=published).frame
            for run in ("ur-20_02_19_14harm50secLoad", "ur-20_02_19_14harm50sec")
        )
    found = estimate_drive_gains(
        Robot.from_urdf(data_dir / "ur10e" / "ur10e_min.urdf"),
        loaded,
        unloaded,
        2.805,
        drive_gains=published,
    )
    assert np.all((found.factors[1:] > 0.87) & (found.factors[1:] < 1.0))
