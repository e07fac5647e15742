# SPDX-License-Identifier: BSD-3-Clause
"""One list of checks: what it suspects, how sure, and the option that fixes it."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import Settings, diagnose
from skidyn.effects import Signals
from skidyn.exceptions import LogError
from skidyn.identification import RBDRegressor
from skidyn.logs import check_log, read_log
from skidyn.measurement import (
    Measurement,
    Remedy,
    Suspicion,
    _torque,
    check_measurement,
    list_checks,
    refuse_certain,
)
from skidyn.measurement._fits import Reading
from skidyn.measurement._readings import Change

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, "stribeck", joints=[2], n_trajectories=4, random_state=3)


@pytest.fixture
def signals():
    t = np.arange(0, 20, 0.01)
    rate = np.array([0.7, 1.3])
    phase = t[:, None] * rate
    return Signals(
        1.2 * np.sin(phase),
        1.2 * rate * np.cos(phase),
        -1.2 * rate**2 * np.sin(phase),
        np.zeros(len(t), dtype=int),
        time=t,
    )


@pytest.fixture
def torque(signals):
    noise = np.random.default_rng(0).normal(0, 0.05, signals.q.shape)
    friction = 0.8 * signals.dq + 1.2 * np.sign(signals.dq)
    return ROBOT.inverse_dynamics(signals.q, signals.dq, signals.ddq) + friction + noise


def found(signals, torque, robot=ROBOT):
    return check_measurement(Measurement(signals, torque, robot, ("shoulder", "elbow")))


def only(suspicions, check, certainty, remedy):
    told = [s for s in suspicions if s.certainty != "noted"]
    assert [s.check for s in told] == [check], told
    assert told[0].certainty == certainty
    assert (told[0].remedy and told[0].remedy.option) == remedy


def test_nothing_wrong(signals, torque):
    assert found(signals, torque) == []
    assert found(signals, torque, None) == []


def test_degrees_of_positions_alone(signals, torque):
    degrees = signals.with_(q=np.rad2deg(signals.q))
    only(found(degrees, torque), "position_unit", "certain", "--units q=deg")


def test_milliseconds(signals, torque):
    only(
        found(signals.with_(time=signals.time * 1e3), torque),
        *("clock_unit", "certain", "--units time=ms"),
    )


def test_velocity_with_the_other_sign(signals, torque):
    turned = signals.with_(dq=signals.dq * [1, -1])
    only(found(turned, torque), "velocity", "certain", "--flip dq2")


def test_wrapped_position(signals, torque):
    far = signals.with_(q=signals.q + [np.pi, 0])
    wrapped = far.with_(q=(far.q + np.pi) % (2 * np.pi) - np.pi)
    told = found(wrapped, torque)
    assert "--unwrap" in {s.remedy.option for s in told if s.check == "wrapped_position"}


def test_torque_in_newton_millimetres(signals, torque):
    only(found(signals, 1e3 * torque), "torque_scale", "certain", "--units tau=Nmm")


def test_currents(signals, torque):
    told = [s for s in found(signals, torque * 0.05) if s.check == "torque_scale"]
    assert told and "motor currents" in told[0].suspicion


@pytest.mark.parametrize("joint", [0, 1])
def test_torque_with_the_other_sign(signals, torque, joint):
    sign = np.where(np.arange(2) == joint, -1, 1)
    only(found(signals, torque * sign), "reading", "certain", f"--flip tau{joint + 1}")


def told_of(frame, robot=ROBOT):
    return {s.check: s for s in check_log(frame, robot).checks}


def test_exchanged_torques():
    frame = LOG.frame.assign(tau1=LOG.frame["tau2"], tau2=LOG.frame["tau1"])
    reading = told_of(frame)["reading"]
    assert reading.certainty == "certain" and reading.remedy.option == "--order tau=2,1"


def test_torque_without_gravity(signals, torque):
    told = found(signals, torque - ROBOT.gravity_torque(signals.q))
    only(told, "reading", told[0].certainty, "--gravity=0,0,0")


def test_torque_without_sign():
    robot = load_scara()
    log = make_hidden_effect_log(robot, None, n_trajectories=4, random_state=5)
    names = [f"tau{k}" for k in range(1, 5)]
    quality = check_log(log.frame.assign(**{n: log.frame[n].abs() for n in names}), robot)
    told = [s for s in quality.checks if s.check == "unsigned_torque"]
    assert told and told[0].certainty == "certain"
    assert told[0].remedy.option == "--torque-sign command"


def test_repeated_rows(signals, torque):
    held = np.arange(len(signals.q)) // 2 * 2
    repeated = signals.with_(q=signals.q[held], dq=signals.dq[held])
    told = {s.check: s for s in found(repeated, torque)}
    assert told["repeated_rows"].remedy.option == "--drop-repeated"


def test_clock_that_jitters(signals, torque):
    stamps = signals.time + np.random.default_rng(1).uniform(-1e-3, 1e-3, len(signals.time))
    told = {s.check: s for s in found(signals.with_(time=stamps), torque)}
    assert told["clock_jitter"].certainty == "certain"
    assert told["clock_jitter"].remedy.option == "--clock regular"


def test_samples_that_really_were_uneven():
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.004, 0.016, 3000))
    phase = t[:, None] * [0.7, 1.3]
    motion = Signals(
        np.sin(phase), np.cos(phase) * [0.7, 1.3], 0 * phase, np.zeros(3000, int), time=t
    )
    told = {s.check: s for s in found(motion, phase, None)}
    assert told["clock_jitter"].certainty == "noted" and told["clock_jitter"].remedy is None


def test_late_torque():
    assert "torque_delay" not in told_of(LOG.frame)
    frame = LOG.frame.copy()
    for _, run in LOG.frame.groupby("trajectory"):
        for name in ("tau1", "tau2"):
            frame.loc[run.index, name] = np.interp(run["time"] - 0.02, run["time"], run[name])
    delay = told_of(frame)["torque_delay"]
    assert "late" in delay.suspicion and delay.certainty == "suspected"
    assert float(delay.remedy.option.partition("=")[2]) == pytest.approx(0.02, abs=0.003)


def test_saturation(signals, torque):
    limit = 0.8 * np.abs(torque[:, 0]).max()
    cut = np.column_stack([np.clip(torque[:, 0], -limit, limit), torque[:, 1]])
    told = {s.check: s for s in found(signals, cut)}
    assert told["clipped_torque"].joints == (1,)


def test_still_joint(signals, torque):
    still = signals.with_(q=signals.q * [1, 0], dq=signals.dq * [1, 0])
    told = {s.check: s for s in found(still, torque)}
    assert told["still_joint"].joints == (2,) and "elbow" in str(told["still_joint"])


def test_certain_ones_come_first_and_stop_a_diagnosis():
    turned = LOG.X.assign(dq2=-LOG.X["dq2"])
    model = RBDRegressor(ROBOT)
    with pytest.raises(LogError, match="--flip dq2.*force=True"):
        diagnose(model, turned, LOG.y)
    with pytest.warns(UserWarning, match="has the other sign"):
        forced = diagnose(model, turned, LOG.y, settings=Settings(max_findings=0), force=True)
    assert forced.checks[0].certainty == "certain"
    assert forced.to_dict()["checks"][0]["remedy"] == {
        "option": "--flip dq2",
        "code": "flip=['dq2']",
    }


def test_refusal_names_every_remedy():
    two = [
        Suspicion("a", "this", "seen", "certain", remedy=Remedy("--flip x", "flip=['x']")),
        Suspicion("b", "that", "seen", "suspected", remedy=Remedy("--unwrap", "unwrap=True")),
    ]
    with pytest.raises(LogError, match="--flip x") as caught:
        refuse_certain(two)
    assert "--unwrap" not in str(caught.value)


def test_checks_have_names_of_their_own():
    checks = list_checks()
    assert len({check.name for check in checks}) == len(checks)
    assert all(check.suspects for check in checks)


def test_clock_at_another_rate(signals, torque):
    slow = found(signals.with_(time=2 * signals.time), torque)
    only(slow, "clock_unit", slow[0].certainty, "--gain time=0.5")


def test_positions_in_turns(signals, torque):
    only(
        found(signals.with_(q=signals.q / 2 / np.pi), torque),
        *("position_unit", "certain", "--units q=rev"),
    )


def test_counts_of_an_encoder(signals, torque):
    counts = np.round(signals.q * 4096 / 2 / np.pi)
    told = found(signals.with_(q=counts), torque)[0]
    assert (told.check, told.certainty) == ("position_unit", "certain")
    name, size = told.remedy.option.split("=")
    assert name == "--gain q" and float(size) == pytest.approx(2 * np.pi / 4096)


def test_exchanged_velocities(signals, torque):
    only(
        found(signals.with_(dq=signals.dq[:, ::-1]), torque),
        *("velocity", "certain", "--order dq=2,1"),
    )


def test_late_velocities(signals, torque):
    late = np.stack([np.interp(signals.time - 0.03, signals.time, dq) for dq in signals.dq.T], 1)
    only(found(signals.with_(dq=late), torque), "velocity_delay", "suspected", "--late dq=0.03")


def test_joined_recordings_are_told_once_and_cut_for_other_checks(signals, torque):
    kept = np.r_[0:700, 1250:2000]
    joined = signals.take(kept).with_(time=signals.time[: len(kept)])
    only(found(joined, torque[kept]), "joined", "certain", "--split-leaps")


def test_zero_of_a_joint(signals, torque):
    told = found(signals.with_(q=signals.q + [0.0, 1.0]), torque)
    assert [s.check for s in told] == ["reading"]
    name, value = told[0].remedy.option.split("=")
    assert name == "--zero q2" and float(value) == pytest.approx(1.0, abs=0.02)


def test_torques_that_are_held(signals, torque):
    held = torque[np.arange(len(torque)) // 4 * 4]
    only(found(signals, held), "held_torque", "certain", "--drop-repeated")


def test_torque_cut_at_zero(signals, torque):
    cut = torque.copy()
    cut[:, 1] = np.maximum(cut[:, 1], 0)
    told = [s for s in found(signals, cut) if s.certainty == "certain"]
    assert [(s.check, s.joints) for s in told] == [("unsigned_torque", (2,))]
    assert told[0].remedy is None


def test_torque_of_something_else():
    wave = np.random.default_rng(4).normal(size=len(LOG.frame))
    wave = np.convolve(wave, np.hanning(80), "same")
    other = LOG.frame.assign(tau2=LOG.frame["tau2"].std() * wave / wave.std())
    assert told_of(other)["unexplained"].joints == (2,)


def test_stated_bodies_concern_only_those_who_keep_them(signals, torque):
    torque = torque.copy()
    torque[:, 1] += 9 * np.cos(signals.q.sum(1))  # a weight that the description lacks

    def certainty(identified):
        names = ("shoulder", "elbow")
        told = check_measurement(Measurement(signals, torque, ROBOT, names, identified))
        return next((s.certainty for s in told if s.check == "bodies"), None)

    assert certainty(False) == "suspected"
    assert certainty(None) == "noted"
    assert certainty(True) is None


def test_torque_without_noise(signals):
    smooth = ROBOT.inverse_dynamics(signals.q, signals.dq, signals.ddq) + 0.8 * signals.dq
    assert "smooth_torque" in [s.check for s in found(signals, smooth, None)]
    noisy = smooth + np.random.default_rng(0).normal(0, 1e-3, smooth.shape)
    assert found(signals, noisy, None) == []


@pytest.mark.parametrize("column", ["q2", "dq2"])
def test_a_position_or_velocity_that_never_changes(column):
    told = told_of(LOG.frame.assign(**{column: 0.3}))["velocity"]
    assert told.certainty == "certain" and told.joints == (2,) and "constant" in told.suspicion


def test_torque_of_one_joint_that_is_late():
    log = make_hidden_effect_log(ROBOT, None, n_trajectories=5, duration=6.0, random_state=5)
    frame = log.frame
    late = frame.groupby("trajectory")["tau2"].shift(3).bfill()
    told = told_of(frame.assign(tau2=late))["torque_delay"]
    assert told.joints == (2,) and told.remedy.option.startswith("--late tau2=0.0")


def test_positions_in_half_precision():
    short = {name: LOG.frame[name].astype(np.float16).astype(float) for name in ("q1", "q2")}
    assert told_of(LOG.frame.assign(**short))["coarse_position"].joints == (1, 2)


def test_stamps_are_certain_only_where_they_do_harm():
    log = make_hidden_effect_log(ROBOT, None, n_trajectories=4, random_state=6)
    noise = np.random.default_rng(0).uniform(-1, 1, len(log.frame))
    certainties = {
        size: told_of(log.frame.assign(time=log.frame["time"] + size * noise))["clock_jitter"]
        for size in (2e-5, 1e-3)
    }
    assert certainties[2e-5].certainty == "suspected"
    assert "little harm" in certainties[2e-5].evidence
    assert certainties[1e-3].certainty == "certain"


def test_time_in_minutes(signals, torque):
    told = found(signals.with_(time=signals.time / 60), torque)
    assert told[0].suspicion == "time looks like minutes"
    assert told[0].certainty == "certain" and told[0].remedy.option == "--units time=min"


def test_rows_that_run_backwards(signals, torque):
    backwards = signals.with_(q=signals.q[::-1], dq=signals.dq[::-1])
    told = found(backwards, torque[::-1])
    assert told[0].suspicion == "rows run backwards in time" and told[0].certainty == "certain"
    flipped = found(signals.with_(dq=-signals.dq), torque)
    assert flipped[0].remedy.option == "--flip dq1,dq2"


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_the_torque_of_one_joint_at_another_scale(factor):
    told = told_of(LOG.frame.assign(tau2=factor * LOG.frame["tau2"]))["torque_scale"]
    name, _, size = told.remedy.option.partition("=")
    assert told.joints == (2,) and name == "--gain tau2"
    assert float(size) == pytest.approx(1 / factor, rel=0.1)


def test_the_velocity_of_one_joint_is_late():
    frame = LOG.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        time, values = frame.loc[rows, "time"], frame.loc[rows, "dq2"]
        frame.loc[rows, "dq2"] = np.interp(time - 0.03, time, values)
    told = told_of(frame)["velocity_delay"]
    name, _, lag = told.remedy.option.partition("=")
    assert told.joints == (2,) and name == "--late dq2"
    assert float(lag) == pytest.approx(0.03, abs=0.004)


def test_an_encoder_that_is_stuck_in_one_recording():
    frame = LOG.frame.copy()
    run = frame["trajectory"].unique()[1]
    frame.loc[frame["trajectory"] == run, "q2"] = 0.4
    told = told_of(frame)["velocity"]
    assert told.joints == (2,) and told.evidence.startswith(f"in {run};")


def test_a_torque_far_beyond_the_effort_limit():
    robot = replace(ROBOT, effort_limits=2 * LOG.frame[["tau1", "tau2"]].abs().max().to_numpy())
    assert "torque_scale" not in told_of(LOG.frame, robot)
    told = told_of(LOG.frame.assign(tau2=1e3 * LOG.frame["tau2"]), robot)["torque_scale"]
    assert told.joints == (2,) and told.remedy.option == "--gain tau2=0.001"


def test_a_torque_that_is_turned_round_twice_is_as_it_was(monkeypatch):
    every, one = frozenset([0, 1]), frozenset([1])
    changes = [
        Change("torque_sign", (0, 1), Reading(flip_torque=every), gain=80.0, drop=0.6),
        Change("torque_sign", (0,), Reading(flip_torque=one), gain=50.0, drop=0.5),
    ]
    monkeypatch.setattr(_torque, "find_changes", lambda fits: changes)
    told = told_of(LOG.frame)["reading"]
    assert told.joints == (2,) and told.remedy.option == "--flip tau2"


@pytest.mark.parametrize("backwards", [False, True])
def test_torque_before_drives_are_enabled(backwards, tmp_path):
    frame = LOG.frame.copy()
    for rows in frame.groupby("trajectory").groups.values():
        frame.loc[rows[-40:] if backwards else rows[:40], ["tau1", "tau2"]] = 0.0
    told = [s for s in check_log(frame, ROBOT).checks if s.certainty != "noted"]
    assert [s.check for s in told] == ["constant_torque"] and told[0].certainty == "certain"
    assert "in 160 rows" in told[0].evidence and told[0].remedy.option == "--drop-repeated"
    frame.to_parquet(tmp_path / "log.parquet")
    kept = read_log(tmp_path / "log.parquet", robot=ROBOT, drop_repeated=True)
    assert len(kept) == len(frame) - 160 and (kept[["tau1", "tau2"]] != 0).all(axis=None)


def test_a_description_without_gravity():
    told = told_of(LOG.frame, replace(ROBOT, gravity=np.zeros(3)))["reading"]
    assert told.remedy.option.startswith("--gravity=")
    x, y, z = (float(v) for v in told.remedy.option.partition("=")[2].split(","))
    assert z == pytest.approx(-9.8, abs=0.3) and abs(y) < 0.1 and abs(x) < 2


def test_row_numbers_in_the_place_of_time():
    step = float(np.median(np.diff(LOG.frame["time"])))
    told = told_of(LOG.frame.assign(time=np.round(LOG.frame["time"] / step)))["clock_unit"]
    assert told.remedy.option == f"--gain time={step:g}"


@pytest.mark.parametrize("factor", [0.5, 4.0])
def test_a_rate_that_is_wrong_in_clock_and_velocities(factor):
    robot = load_ur5()
    frame = make_hidden_effect_log(
        robot, None, n_trajectories=4, duration=6.0, random_state=3
    ).frame
    velocities = {f"dq{k}": frame[f"dq{k}"] / factor for k in range(1, 7)}
    told = told_of(frame.assign(time=factor * frame["time"], **velocities), robot)["torque_scale"]
    assert told.suspicion.startswith("the clock runs at another rate")
    words = dict(pair.split("=") for pair in told.remedy.option.split(" ")[1].split(","))
    assert float(words["time"]) == pytest.approx(1 / factor, rel=0.1)
    assert float(words["dq"]) == pytest.approx(factor, rel=0.1)
