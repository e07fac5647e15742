# SPDX-License-Identifier: BSD-3-Clause
"""Where a model fails: joints by error over noise, and the place of the excess."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.diagnosis import Comparison

NOISE = 0.2


@pytest.fixture(scope="module")
def bare(complete):
    """A comparison of a planar arm whose residual is white noise."""
    comparison = complete.comparison
    noise = np.random.default_rng(0).normal(scale=NOISE, size=comparison.measured.shape)
    return replace(comparison, predicted=comparison.measured - noise)


@pytest.fixture(scope="module")
def told(complete):
    """Makes a diagnosis of a comparison at a noise of each joint."""

    def make(comparison, *noise):
        return replace(complete, comparison=comparison, noise_floor=np.array(noise))

    return make


def failing(bare: Comparison, excess, joint=1):
    """The same with an excess torque on one joint."""
    predicted = bare.predicted.copy()
    predicted[:, joint] -= excess
    return replace(bare, predicted=predicted)


def test_nothing_is_listed_where_the_error_is_the_noise(bare, told):
    assert told(bare, NOISE, NOISE).failures == []


def test_joints_are_ranked_by_error_over_noise_not_by_error(bare, told):
    both = failing(failing(bare, 0.5, 0), 0.4, 1)
    found = told(both, NOISE, NOISE / 4).failures
    assert [f.joint for f in found] == [2, 1]
    assert found[0].ratio == pytest.approx(found[0].rmse / found[0].noise)
    assert "(joint 2)" in found[0].sentence and "N m" in found[0].sentence


def test_an_error_at_rest_or_at_reversals_is_no_failure(bare, told):
    away = np.where(bare.judged_samples[:, 1], 0.0, 5.0)
    comparison = failing(bare, away)
    assert told(comparison, NOISE, NOISE).failures == []


def place(failures, kind):
    (failure,) = failures
    return next(p for p in failure.places if p.kind == kind)


def test_the_regime_of_the_excess(bare, told):
    speed = np.abs(bare.signals.dq[:, 1])
    fast = speed > 0.8 * np.quantile(speed, 0.95)
    found = told(failing(bare, np.where(fast, 2.0, 0.0)), NOISE, NOISE).failures
    assert place(found, "regime").regime == "fast"
    assert place(found, "regime").share_of_excess > 0.9


def test_the_range_of_position(bare, told):
    q = bare.signals.q[:, 1]
    low, high = np.quantile(q, [0.6, 0.8])
    found = told(failing(bare, np.where((q > low) & (q < high), 2.0, 0.0)), NOISE, NOISE).failures
    assert place(found, "position").low == pytest.approx(low, abs=0.1)
    assert place(found, "position").high == pytest.approx(high, abs=0.1)


def test_the_trajectories(bare, told):
    names = np.unique(bare.signals.trajectory)
    acts = bare.signals.trajectory == names[2]
    found = told(failing(bare, np.where(acts, 2.0, 0.0)), NOISE, NOISE).failures
    assert place(found, "trajectory").trajectories == (int(names[2]),)


def test_the_seconds(bare, told):
    clock, trajectory = bare.signals.clock, bare.signals.trajectory
    name = np.unique(trajectory)[1]
    here = clock[trajectory == name]
    low, high = here[0] + 0.4 * np.ptp(here), here[0] + 0.5 * np.ptp(here)
    acts = (trajectory == name) & (clock > low) & (clock < high)
    found = told(failing(bare, np.where(acts, 5.0, 0.0)), NOISE, NOISE).failures
    when = place(found, "time")
    assert when.trajectories == (int(name),)
    assert [when.low, when.high] == pytest.approx([low - here[0], high - here[0]], abs=0.5)


def test_an_excess_that_is_everywhere_has_no_place(bare, told):
    found = told(failing(bare, 1.0), NOISE, NOISE).failures
    assert found[0].places == ()
    assert "whole motion" in found[0].sentence


def test_a_log_without_noise_is_not_judged_by_rounding(complete, told):
    comparison = complete.comparison
    exact = replace(comparison, predicted=comparison.measured * (1 + 1e-12))
    assert told(exact, 0.0, 0.0).failures == []


def test_dry_friction_may_hold_any_torque_at_rest(bare, told):
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
    error = told(comparison, NOISE, NOISE).rest_errors[1]
    assert error.stiction == pytest.approx(1.5)
    assert error.rmse > 0.2 and error.beyond == 0.0
    stronger = replace(comparison, predicted=bare.measured - 3 * held)
    assert told(stronger, NOISE, NOISE).rest_errors[1].beyond > 0.5


def test_a_model_without_friction_terms_does_not_tell_what_friction_holds(bare, told):
    stopped = bare.signals.dq.copy()
    stopped[:100] = 0.0
    signals = bare.signals.with_(dq=stopped)
    comparison = replace(bare, signals=signals, dry_friction=None)
    error = told(comparison, NOISE, NOISE).rest_errors[0]
    assert error.stiction is None and error.beyond is None
