# SPDX-License-Identifier: BSD-3-Clause
"""What fixes a log is asked for, counted, and refused by name where it cannot be done."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.exceptions import LogError, SkidynError
from skidyn.identification import RBDRegressor
from skidyn.logs import check_log, read_log

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=3, duration=4.0).frame


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(
    "spoil, mend",
    [
        ({"tau2": -1.0}, {"flip": ["joint2"]}),
        ({"tau2": -1.0}, {"flip": [2]}),
        ({"q1": -1.0, "dq1": -1.0}, {"flip": ["q1"]}),
        ({"dq1": -1.0}, {"flip": ["dq1"]}),
        ({"tau1": 50.0}, {"gain": {"tau1": 0.02}}),
        ({"tau1": 1e3, "tau2": 1e3}, {"gain": {"tau": 1e-3}}),
    ],
)
def test_factors_are_taken_back(read, spoil, mend):
    other = LOG.assign(**{name: factor * LOG[name] for name, factor in spoil.items()})
    mended = read(other, robot=ROBOT, **mend)
    for name in spoil:
        np.testing.assert_allclose(mended[name], LOG[name], atol=1e-9)
    assert any(note.startswith(("flip", "gain")) for note in mended.attrs["notes"])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_order_and_zero_are_taken_back(read):
    swapped = {f"{q}{k}": LOG[f"{q}{3 - k}"] for q in ("q", "dq", "tau") for k in (1, 2)}
    mended = read(LOG.assign(**swapped), order=[2, 1])
    assert any(note.endswith("[2, 1] in 1200 of 1200 rows") for note in mended.attrs["notes"])
    np.testing.assert_allclose(mended["q2"], LOG["q2"])
    np.testing.assert_allclose(mended["tau1"], LOG["tau1"])
    torques = read(LOG.assign(tau1=LOG["tau2"], tau2=LOG["tau1"]), order={"tau": [2, 1]})
    np.testing.assert_allclose(torques["tau1"], LOG["tau1"])
    moved = {f"{q}{k}": LOG[f"{q}{3 - k}"] for q in ("q", "dq") for k in (1, 2)}
    motion = read(LOG.assign(**moved), order={"motion": [2, 1]})
    np.testing.assert_allclose(motion[["q1", "dq2", "tau1"]], LOG[["q1", "dq2", "tau1"]])
    np.testing.assert_allclose(
        read(LOG.assign(q1=LOG["q1"] + 1), zero={"q1": 1.0})["q1"], LOG["q1"]
    )


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_jittering_stamps_become_even_and_missing_rows_stay_missing(read):
    jitter = np.random.default_rng(0).uniform(-2e-3, 2e-3, len(LOG))
    holes = LOG.assign(time=LOG["time"] + jitter).drop(index=[50, 51, 700])
    mended = read(holes, clock="regular")
    steps = np.concatenate([np.diff(run["time"]) for _, run in mended.groupby("trajectory")])
    whole = steps / 0.01
    assert np.abs(whole - np.round(whole)).max() < 0.01 and sorted(np.round(whole))[-2:] == [2, 3]
    assert any("stamps were moved" in note for note in mended.attrs["notes"])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_repeated_rows_are_left_out_and_rest_is_kept(read):
    rest = LOG.copy()
    still = rest.index[:100]
    rest.loc[still, ["q1", "q2"]] = LOG.loc[0, ["q1", "q2"]].to_numpy()
    rest.loc[still, ["dq1", "dq2"]] = 0.0
    stale = rest.copy()
    moving = np.flatnonzero(rest.index > 150)[::4]
    signals = ["q1", "q2", "dq1", "dq2"]
    stale.loc[moving, signals] = rest.loc[moving - 1, signals].to_numpy()
    mended = read(stale, drop_repeated=True)
    gone = len(rest) - len(mended)
    assert 0.9 * len(moving) < gone <= len(moving)
    assert check_log(mended).repeated_rows == 0
    assert any(f"{gone} of {len(rest)} rows left out" in n for n in mended.attrs["notes"])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_delay_and_wrapped_positions_are_taken_out(read):
    late = LOG.copy()
    for _, run in LOG.groupby("trajectory"):
        late.loc[run.index, "tau1"] = np.interp(run["time"] - 0.02, run["time"], run["tau1"])
    mended = read(late, late={"tau1": 0.02})
    same = LOG.merge(mended, on=["time", "trajectory"], suffixes=("", "_mended"))
    assert np.abs(same["tau1"] - same["tau1_mended"]).median() < 1e-9
    far = LOG.assign(q1=LOG["q1"] * 4)
    wrapped = far.assign(q1=(far["q1"] + np.pi) % (2 * np.pi) - np.pi)
    turns = (read(wrapped, unwrap=True)["q1"] - far["q1"]) / 2 / np.pi
    assert np.abs(turns - np.round(turns)).max() < 1e-9
    assert turns.groupby(LOG["trajectory"]).std().max() < 1e-9


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_recordings_are_in_the_same_turn_after_unwrapping(read):
    first = LOG["trajectory"].min()
    apart = LOG.assign(q1=LOG["q1"] + np.where(LOG["trajectory"] == first, 0.5, -0.5))
    middle = apart["q1"].median()
    wrapped = apart.assign(q1=(apart["q1"] - middle) % (2 * np.pi))
    mended = read(wrapped, unwrap=True)
    turns = (mended["q1"] + middle - apart["q1"]) / 2 / np.pi
    assert np.ptp(turns) < 1e-9
    assert any("parts were moved by whole turns" in note for note in mended.attrs["notes"])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_delay_that_grows_is_taken_out(read):
    late = LOG.copy()
    for _, run in LOG.groupby("trajectory"):
        at = (run["time"] - 0.01) - 0.005 * (run["time"] - run["time"].iloc[0])
        late.loc[run.index, "tau1"] = np.interp(at, run["time"], run["tau1"])
    mended = read(late, late={"tau1": (0.01, 0.005)})
    same = LOG.merge(mended, on=["time", "trajectory"], suffixes=("", "_mended"))
    left, before = same["tau1"] - same["tau1_mended"], LOG["tau1"] - late["tau1"]
    assert left.std() < 0.2 * before.std()
    told = "late: tau1 by 10 ms and 5 ms more per second removed; "
    assert any(note.startswith(told) for note in mended.attrs["notes"])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_sums_are_those_of_recorded_columns(read):
    mended = read(
        LOG, combine={"tau1": "tau1 + tau2", "tau2": "-0.5*tau1-2*tau2"}, gain={"tau2": 3}
    )
    np.testing.assert_allclose(mended["tau1"], LOG["tau1"] + LOG["tau2"])
    np.testing.assert_allclose(mended["tau2"], -1.5 * LOG["tau1"] - 6 * LOG["tau2"])
    told = f"combine: tau1 was replaced by tau1+tau2 in {len(LOG)} of {len(LOG)} rows"
    assert told in mended.attrs["notes"]


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_low_pass_is_undone_within_recordings(read):
    filtered = LOG.copy()
    for rows in LOG.groupby("trajectory").indices.values():
        time, values = LOG["time"].to_numpy()[rows], LOG["tau1"].to_numpy()[rows].copy()
        for i in range(1, len(rows)):
            passed = 1 - np.exp((time[i - 1] - time[i]) / 0.03)
            values[i] = values[i - 1] + passed * (values[i] - values[i - 1])
        filtered.loc[rows, "tau1"] = values
    mended = read(filtered, lowpass={"tau1": 0.03})
    np.testing.assert_allclose(mended["tau1"], LOG["tau1"], atol=1e-9)
    assert any(note.startswith("lowpass: a filter of 30 ms") for note in mended.attrs["notes"])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_velocities_are_derived_on_request(read):
    frame = read(LOG.assign(dq2=LOG["dq2"].abs()), derive=["dq2"])
    steps = np.gradient(frame["q2"][:50], frame["time"][:50])
    np.testing.assert_allclose(frame["dq2"][:49], steps[:49], atol=1e-9)
    np.testing.assert_array_equal(frame["dq1"], read(LOG)["dq1"])
    assert any("dq2 was replaced by differences" in note for note in frame.attrs["notes"])
    with pytest.raises(LogError, match="derive: q2 is not a velocity"):
        read(LOG, derive=["q2"])


def test_sign_from_the_command(read):
    command = {f"cmd{k}": LOG[f"q{k}"] + 0.01 * LOG[f"tau{k}"] for k in (1, 2)}
    unsigned = LOG.assign(tau1=LOG["tau1"].abs(), tau2=LOG["tau2"].abs(), **command)
    np.testing.assert_allclose(read(unsigned, torque_sign="command")["tau1"], LOG["tau1"])


@pytest.mark.parametrize(
    "options, words",
    [
        ({"flip": ["elbow"]}, "flip: 'elbow' is neither a joint .joint1, joint2. nor a column"),
        ({"flip": ["tau7"]}, "flip: 'tau7'"),
        ({"order": [1, 1]}, r"order: \[1, 1\] is not an order of 2 joints"),
        ({"order": {"volts": [2, 1]}}, "order: 'volts' is none of"),
        ({"order": {"temp": [2, 1]}}, "order: the log has no temp1"),
        ({"gain": {"tau1": 0.0}}, "gain: tau1 cannot be multiplied by 0.0"),
        ({"gain": {"volts": 2.0}}, "gain: the log has no volts"),
        ({"zero": {"tau1": 2.0}}, "zero: tau1 is neither a position nor a velocity"),
        ({"zero": {"q1": float("nan")}}, "zero: q1 has the value nan"),
        ({"late": {"volts": 0.1}}, "late: the log has no volts"),
        ({"late": {"tau": 100.0}}, "late: no recording is longer than"),
        ({"combine": {"tau1": "tau1+volts"}}, "the log has no signal volts"),
        ({"combine": {"tau9": "tau1+tau2"}}, "the log has no signal tau9"),
        ({"combine": {"tau1": "tau1*tau2"}}, "is not a sum of columns"),
        ({"combine": {"tau1": "tau1tau2+"}}, "is not a sum of columns"),
        ({"combine": {"tau1": "2"}}, "is not a sum of columns"),
        ({"combine": {"tau1": ""}}, "is not a sum of columns"),
        ({"combine": {"time": "tau1"}}, "the log has no signal time"),
        ({"late": {"tau": float("nan")}}, "late: the delay of tau is nan"),
        ({"late": {"tau": (0.1, float("inf"))}}, r"late: the delay of tau is \(0.1, inf\)"),
        ({"late": {"tau": (0.1, 0.2, 0.3)}}, "late: the delay of tau is"),
        ({"late": {"tau": (0.1, -1.0)}}, "and their growth per second"),
        ({"late": {"tau": "0.1*t"}}, "late: the delay of tau is 0.1"),
        ({"lowpass": {"volts": 0.1}}, "lowpass: the log has no volts"),
        ({"lowpass": {"tau": 0.0}}, "lowpass: got tau1 and 0 s"),
        ({"lowpass": {"time": 0.1}}, "lowpass: got time and"),
        ({"clock": "even"}, "clock is 'even'"),
        ({"torque_sign": "guess"}, "torque_sign is 'guess'"),
        ({"torque_sign": "command"}, "the log has no cmd1, cmd2"),
        ({"gravity": [0, 0, 0]}, r"gravity is \[0, 0, 0\]; expected three numbers .* not all zero"),
        ({"gravity": [0, -9.81]}, "gravity is .*expected three finite numbers"),
        ({"gravity": "down"}, "gravity is 'down'"),
    ],
)
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_what_cannot_be_fixed_is_refused_by_name(read, options, words):
    with pytest.raises(SkidynError, match=words):
        read(LOG, robot=ROBOT, **options)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_gravity_that_was_taken_off_is_given_back(read):
    pull = ROBOT.gravity_torque(LOG[["q1", "q2"]].to_numpy())
    taken = LOG.assign(tau1=LOG["tau1"] - pull[:, 0], tau2=LOG["tau2"] - pull[:, 1])
    mended = read(taken, robot=ROBOT, restore_gravity=True)
    np.testing.assert_allclose(mended[["tau1", "tau2"]], LOG[["tau1", "tau2"]], atol=1e-9)
    with pytest.raises(LogError, match="give robot="):
        read(taken, restore_gravity=True)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(
    "gravity, vector", [([0, -9.81, 0], [0.0, -9.81, 0.0]), ("none", [0.0, 0.0, 0.0])]
)
def test_a_log_is_read_with_the_gravity_that_its_model_must_have(read, gravity, vector):
    log = read(LOG, robot=ROBOT, gravity=gravity)
    assert any(note.startswith("gravity: (") for note in log.attrs["notes"])
    tau = log[["tau1", "tau2"]].to_numpy()
    with pytest.raises(LogError, match="give the model robot.with_gravity"):
        RBDRegressor(ROBOT).fit(log, tau)
    model = RBDRegressor(ROBOT.with_gravity(gravity)).fit(log, tau)
    assert model.robot_.gravity.tolist() == vector
    with pytest.raises(LogError, match="give robot="):
        read(LOG, gravity=gravity)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_recordings_that_were_joined_become_trajectories(read):
    joined = LOG.assign(time=np.arange(len(LOG)) * 0.01, trajectory=0)
    mended = read(joined, split_leaps=True)
    assert mended["trajectory"].tolist() == LOG["trajectory"].tolist()
    assert any(note.startswith("split_leaps: 2 of") for note in mended.attrs["notes"])


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_rows_that_hold_all_torques_are_left_out(read):
    held = LOG.copy()
    held[["tau1", "tau2"]] = LOG[["tau1", "tau2"]].to_numpy()[np.arange(len(LOG)) // 4 * 4]
    mended = read(held, drop_repeated=True)
    assert len(mended) < 0.3 * len(LOG)
    assert mended["tau1"].isin(LOG["tau1"]).all()


@pytest.mark.parametrize("unit", [0.015, 0.025])
def test_stamps_that_are_coarser_than_the_samples(tmp_path, unit):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    coarse = np.round(np.floor(log.frame["time"] / unit) * unit, 9)
    path = tmp_path / "log.parquet"
    log.frame.assign(time=coarse).to_parquet(path)
    with pytest.raises(LogError, match="too coarse for the samples.*--clock regular"):
        read_log(path, robot=log.robot)
    mended = read_log(path, robot=log.robot, clock="regular")
    assert len(mended) == len(log.frame)
    for _, own in mended.groupby("trajectory"):
        assert np.diff(own["time"]) == pytest.approx(0.01, rel=0.02)


def test_positions_that_hold_those_before_them(read):
    log = make_hidden_effect_log(load_ur5(), None, n_trajectories=2, duration=2.0).frame
    sums = {}
    for quantity in ("q", "dq"):
        sums[f"{quantity}3"] = log[f"{quantity}3"] + log[f"{quantity}2"]
        sums[f"{quantity}4"] = log[f"{quantity}4"] + sums[f"{quantity}3"]
        sums[f"{quantity}6"] = log[f"{quantity}6"] - log[f"{quantity}5"]
    mended = read(log.assign(**sums), summed={"q3": "q2", "q4": "q3", "q6": "-q5"})
    for name in sums:
        np.testing.assert_allclose(mended[name], log[name], atol=1e-9)
    assert sum(note.startswith("summed:") for note in mended.attrs["notes"]) == 3


@pytest.mark.parametrize(
    "summed, message",
    [
        ({"q3": "q2"}, "the log has q1 .. q2"),
        ({"q2": "q2"}, "expected for example q3=q2"),
        ({"q2": "elbow"}, "expected for example q3=q2"),
        ({"tau2": "q1"}, "expected for example q3=q2"),
    ],
)
def test_sums_that_cannot_be_taken_apart(read, summed, message):
    with pytest.raises(LogError, match=message):
        read(LOG, summed=summed)


def test_a_rate_that_fills_the_memory_is_refused(read):
    with pytest.raises(LogError, match="resample_rate is 1e\\+12 Hz, at which the log would have"):
        read(LOG, resample_rate=1e12)


@pytest.mark.parametrize("rate", [0.0, -5.0, np.nan, np.inf])
def test_rates_that_are_none(read, rate):
    with pytest.raises(LogError, match="above zero"):
        read(LOG, resample_rate=rate)
    with pytest.raises(LogError, match="above zero"):
        read(LOG.drop(columns=["time", "trajectory"]), rate=rate)
