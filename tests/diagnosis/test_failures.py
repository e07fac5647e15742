# SPDX-License-Identifier: BSD-3-Clause
"""Where a model fails: joints by error over noise, and the place of the excess."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import Comparison, diagnose
from skidyn.diagnosis._failures import find_failures, find_rest_errors
from skidyn.identification import RBDRegressor

NOISE = 0.2


@pytest.fixture(scope="module")
def bare(complete):
    """A comparison of a planar arm whose residual is white noise."""
    comparison = complete.comparison
    noise = np.random.default_rng(0).normal(scale=NOISE, size=comparison.measured.shape)
    return replace(comparison, predicted=comparison.measured - noise)


def failing(bare: Comparison, excess, joint=1):
    """The same with an excess torque on one joint."""
    predicted = bare.predicted.copy()
    predicted[:, joint] -= excess
    return replace(bare, predicted=predicted)


def test_nothing_is_listed_where_the_error_is_the_noise(bare):
    assert find_failures(bare, [NOISE] * 2) == []


def test_joints_are_ranked_by_error_over_noise_not_by_error(bare):
    both = failing(failing(bare, 0.5, 0), 0.4, 1)
    found = find_failures(both, [NOISE, NOISE / 4])
    assert [f.joint for f in found] == [2, 1]
    assert found[0].ratio == pytest.approx(found[0].rmse / found[0].noise)
    assert "(joint 2)" in found[0].sentence and "N m" in found[0].sentence


def test_an_error_at_rest_or_at_reversals_is_no_failure(bare):
    away = np.where(bare.judged_samples[:, 1], 0.0, 5.0)
    comparison = failing(bare, away)
    assert find_failures(comparison, [NOISE] * 2) == []


def place(failures, kind):
    (failure,) = failures
    return next(p for p in failure.places if p.kind == kind)


def test_the_regime_of_the_excess(bare):
    speed = np.abs(bare.signals.dq[:, 1])
    fast = speed > 0.8 * np.quantile(speed, 0.95)
    found = find_failures(failing(bare, np.where(fast, 2.0, 0.0)), [NOISE] * 2)
    assert place(found, "regime").regime == "fast"
    assert place(found, "regime").share_of_excess > 0.9


def test_the_range_of_position(bare):
    q = bare.signals.q[:, 1]
    low, high = np.quantile(q, [0.6, 0.8])
    found = find_failures(failing(bare, np.where((q > low) & (q < high), 2.0, 0.0)), [NOISE] * 2)
    assert place(found, "position").low == pytest.approx(low, abs=0.1)
    assert place(found, "position").high == pytest.approx(high, abs=0.1)


def test_the_trajectories(bare):
    names = np.unique(bare.signals.trajectory)
    acts = bare.signals.trajectory == names[2]
    found = find_failures(failing(bare, np.where(acts, 2.0, 0.0)), [NOISE] * 2)
    assert place(found, "trajectory").trajectories == (int(names[2]),)


def test_the_seconds(bare):
    clock, trajectory = bare.signals.clock, bare.signals.trajectory
    name = np.unique(trajectory)[1]
    here = clock[trajectory == name]
    low, high = here[0] + 0.4 * np.ptp(here), here[0] + 0.5 * np.ptp(here)
    acts = (trajectory == name) & (clock > low) & (clock < high)
    found = find_failures(failing(bare, np.where(acts, 5.0, 0.0)), [NOISE] * 2)
    when = place(found, "time")
    assert when.trajectories == (int(name),)
    assert [when.low, when.high] == pytest.approx([low - here[0], high - here[0]], abs=0.5)


def test_an_excess_that_is_everywhere_has_no_place(bare):
    found = find_failures(failing(bare, 1.0), [NOISE] * 2)
    assert found[0].places == ()
    assert "whole motion" in found[0].sentence


def test_a_log_without_noise_is_not_judged_by_rounding():
    log = make_hidden_effect_log(load_planar_arm(), None)
    comparison = diagnose(RBDRegressor(log.robot), log.X, log.y).comparison
    exact = replace(comparison, predicted=comparison.measured * (1 + 1e-12))
    assert find_failures(exact, [0.0, 0.0]) == []


def test_dry_friction_may_hold_any_torque_at_rest(bare):
    still = np.zeros_like(bare.sliding)
    signals = bare.signals
    stopped = signals.dq.copy()
    stopped[:100] = 0.0
    still[:100] = True
    friction = np.where(still, 0.0, 1.5)
    held = np.where(still, 1.2, 0.0)
    comparison = replace(
        bare,
        signals=signals.with_(dq=stopped),
        predicted=bare.measured - held,
        dry_friction=friction,
    )
    error = find_rest_errors(comparison)[1]
    assert error.stiction == pytest.approx(1.5)
    assert error.rmse > 0.2 and error.beyond == 0.0
    stronger = replace(comparison, predicted=bare.measured - 3 * held)
    assert find_rest_errors(stronger)[1].beyond > 0.5


def test_a_model_without_friction_terms_does_not_tell_what_friction_holds(bare):
    stopped = bare.signals.dq.copy()
    stopped[:100] = 0.0
    signals = bare.signals.with_(dq=stopped)
    error = find_rest_errors(replace(bare, signals=signals, dry_friction=None))[0]
    assert error.stiction is None and error.beyond is None
