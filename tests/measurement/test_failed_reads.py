# SPDX-License-Identifier: BSD-3-Clause
"""Numbers in single rows that stand for failed reads."""

import numpy as np
import pytest

from skidyn.measurement import Measurement, list_checks


def told_of_reads(signals, torque):
    (check,) = (check for check in list_checks() if check.name == "failed_reads")
    return list(check.look(Measurement(signals, torque, None, ("joint 1", "joint 2"))))


@pytest.fixture(scope="module")
def spoiled(signals, torque):
    """The log with a value at 30 places of one to three rows."""

    def spoil(value, *names, seed=0):
        rng = np.random.default_rng(seed)
        begins = rng.choice(len(torque) - 4, 30, replace=False)
        rows = np.unique(np.concatenate([b + np.arange(rng.integers(1, 4)) for b in begins]))
        blocks = {"q": signals.q.copy(), "dq": signals.dq.copy(), "tau": torque.copy()}
        for name in names:
            quantity = name.rstrip("12")
            blocks[quantity][rows, int(name[-1]) - 1] = value
        return signals.with_(q=blocks["q"], dq=blocks["dq"]), blocks["tau"]

    return spoil


@pytest.mark.parametrize(
    "value, names, option",
    [
        (9999.0, ("q1", "q2", "dq1", "dq2", "tau1", "tau2"), "all=9999"),
        (-1.0, ("q1", "q2"), "q=-1"),
        (0.0, ("q2",), "q2=0"),
        (65535.0, ("dq1",), "dq1=65535"),
        (0.0, ("tau1", "tau2"), "tau=0"),
        (-999.0, ("q1", "dq1", "tau1"), "q1=-999,dq1=-999,tau1=-999"),
        (3276.7, ("tau2",), "tau2=3276.7"),
    ],
)
def test_the_value_and_its_channels(spoiled, value, names, option):
    (told,) = told_of_reads(*spoiled(value, *names))
    assert (told.certainty, told.remedy.option) == ("certain", f"--placeholder {option}")
    assert told.joints == tuple(sorted({int(name[-1]) for name in names}))


@pytest.mark.parametrize("value, names", [(9999.0, ("q1", "q2", "tau1")), (0.0, ("tau1", "tau2"))])
def test_nothing_else_is_suspected(spoiled, found, value, names):
    told = found(*spoiled(value, *names))
    assert [s.check for s in told if s.certainty != "noted"] == ["failed_reads"]


def test_the_evidence_counts_rows_and_places(spoiled):
    motion, tau = spoiled(-1.0, "q1")
    rows = np.flatnonzero(motion.q[:, 0] == -1.0)
    (told,) = told_of_reads(motion, tau)
    assert told.suspicion == "-1 stands for failed reads in positions of joint 1"
    assert f"{len(rows)} rows" in told.evidence and f"row {rows[0]})" in told.evidence


def test_each_value_has_its_own_remedy(spoiled):
    motion, tau = spoiled(-1.0, "q1")
    other, tau = spoiled(9999.0, "tau1", "tau2", seed=1)
    options = {s.remedy.option for s in told_of_reads(motion, tau)}
    assert options == {"--placeholder q1=-1", "--placeholder tau=9999"}


def test_two_values_in_one_channel(spoiled, signals, torque):
    one, _ = spoiled(-1.0, "q1")
    other, _ = spoiled(9999.0, "q1", seed=1)
    both = np.where(one.q == -1.0, one.q, other.q)
    options = {s.remedy.option for s in told_of_reads(signals.with_(q=both), torque)}
    assert options == {"--placeholder q1=-1", "--placeholder q1=9999"}


def test_velocities_that_follow_from_positions_with_failed_reads(spoiled, found, only):
    motion, tau = spoiled(9999.0, "q1", "q2")
    derived = motion.with_(dq=np.gradient(motion.q, motion.clock, axis=0))
    only(found(derived, tau), "failed_reads", "certain", "--placeholder q=9999")


def test_a_few_are_suspected_and_two_are_not(signals, torque):
    for count, certainty in ((2, []), (3, ["suspected"])):
        tau = torque.copy()
        tau[[300, 801, 1502][:count], 0] = 9999.0
        told = [s.certainty for s in told_of_reads(signals, tau)]
        assert told == certainty


def _dead_band(x):
    return np.where(np.abs(x) < 0.2 * np.abs(x).max(), 0.0, x)


def _enabled_late(x):
    return np.where((np.arange(len(x)) < 150)[:, None], 0.0, x)


def _with_spikes(x):
    spikes = x.copy()
    rng = np.random.default_rng(2)
    spikes[rng.choice(len(x), 60, replace=False)] += rng.normal(0, 10 * np.ptp(x), (60, 1))
    return spikes


@pytest.mark.parametrize(
    "change",
    [
        _dead_band,
        _enabled_late,
        _with_spikes,
        lambda x: np.round(x / (0.1 * np.ptp(x))) * 0.1 * np.ptp(x),
        lambda x: np.clip(x, *np.quantile(x, [0.2, 0.8])),
        lambda x: x[np.arange(len(x)) // 4 * 4],
        lambda x: np.sign(x) * np.abs(x).mean(),
    ],
)
def test_ordinary_values_that_recur_are_no_failed_reads(signals, torque, change):
    changed = signals.with_(q=change(signals.q), dq=change(signals.dq))
    assert told_of_reads(changed, change(torque)) == []


def test_a_rest_at_zero_with_a_flickering_last_digit(signals, torque):
    rest = (np.arange(len(torque)) // 200 % 2 == 0)[:, None]
    flicker = np.random.default_rng(0).integers(-1, 2, signals.dq.shape) * 0.005
    velocity = np.where(rest, flicker, signals.dq)
    assert told_of_reads(signals.with_(dq=velocity), torque) == []


def test_a_joint_at_rest_whose_position_changes_by_a_step_now_and_then(signals, torque):
    """Its velocity jumps by as much in both directions, and no value is missing."""
    q, dq = signals.q.copy(), signals.dq.copy()
    q[:, 0] = 0.3
    q[np.random.default_rng(2).choice(len(q) - 10, 40, replace=False) + 5, 0] += 2.4e-5
    dq[:, 0] = np.gradient(q[:, 0], 0.01).round(4)
    rounding = np.random.default_rng(3).choice([-1e-15, 0.0, 1e-15], len(q))
    dq[:, 0] = np.where(dq[:, 0] == 0, rounding, dq[:, 0])
    assert told_of_reads(signals.with_(q=q, dq=dq), torque) == []
