# SPDX-License-Identifier: BSD-3-Clause
"""Intervals of parameters by leaving folds out."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose, parameter_intervals
from skidyn.effects import Term
from skidyn.identification import RBDRegressor


def test_intervals_lie_around_the_fit_and_hold_the_truth(missing, spring_log):
    problem, terms = missing.problem, list(missing.result.fit.terms)
    found = parameter_intervals(problem, terms, missing.result.fit.noise)
    (spring,) = [t for t in terms if t.kind == "spring"]
    value, low, high = found[spring]["k"]
    assert low < value < high
    assert low < float(np.ravel(spring_log.parameters["k"])[0]) < high


def test_shapes_that_are_held_make_intervals_no_wider(missing):
    problem, terms = missing.problem, list(missing.result.fit.terms)
    noise = missing.result.fit.noise
    free, held = (parameter_intervals(problem, terms, noise, shapes) for shapes in (True, False))
    for term in terms:
        for name, interval in held[term].items():
            if isinstance(interval, tuple):
                wide = free[term][name]
                assert interval[2] - interval[1] <= 1.01 * (wide[2] - wide[1])


def test_a_wave_that_may_be_absent_has_an_amplitude_from_zero(missing):
    problem, noise = missing.problem, missing.result.fit.noise
    wave = Term("position_dependent_friction", (1,), {"n": 1.0})
    terms = [*missing.result.fit.terms, wave]
    for shapes in (True, False):
        told = parameter_intervals(problem, terms, noise, shapes)[wave]
        value, low, high = told["A"]
        assert low == 0.0 < value < high
        assert value < high - value


def test_what_acts_in_one_recording_is_judged_by_parts_of_it(complete_log):
    log = complete_log
    highest = log.X.groupby("trajectory")["q1"].max().sort_values()
    limit = float(highest.iloc[-2:].mean())  # one recording goes beyond
    y = np.array(log.y)
    y[:, 0] += 500 * np.maximum(log.X["q1"].to_numpy() - limit, 0)
    problem = diagnose(RBDRegressor(log.robot), log.X, y, checks=(), effects=[]).problem
    stop = Term("end_stop", (1,), {"q_lim": limit, "side": 1.0})
    terms = [*problem.terms, stop]
    noise = problem.fit(terms).noise
    value, low, high = parameter_intervals(problem, terms, noise)[stop]["k"]
    assert 0 < low < 500 < high < 2 * value


@pytest.mark.slow
def test_a_fine_ripple_has_narrow_intervals_of_its_waves_and_size():
    # a wave of 60 periods per rad is another one at waves that differ by two per cent
    log = make_hidden_effect_log(
        load_ur5(), "torque_ripple", joints=[2], n_trajectories=8, duration=8.0, random_state=2
    )
    model = RBDRegressor(log.robot)
    diagnosis = diagnose(model, log.X, log.y, effects=["torque_ripple"], checks=())
    (ripple,) = diagnosis.findings
    waves, size = (ripple.parameters[name] for name in ("N", "A"))
    assert waves["low"] < 60 < waves["high"] and waves["high"] - waves["low"] < 0.1
    assert size["high"] - size["low"] < 0.1 * size["value"]


@pytest.mark.slow
def test_a_size_that_an_uncertain_shape_leaves_open_is_not_zero(spring_log):
    # at slow motion, the torque at 1 rad/s is extrapolated with an uncertain exponent
    robot = spring_log.robot
    log = make_hidden_effect_log(robot, None, n_trajectories=6, duration=6.0, random_state=2)
    X = log.X.copy()
    X["time"] *= 10
    for joint in (1, 2):
        X[f"dq{joint}"] /= 10
        X[f"ddq{joint}"] /= 100
    motion = [X[[f"{s}{j}" for j in (1, 2)]].to_numpy() for s in ("q", "dq", "ddq")]
    y = robot.inverse_dynamics(*motion) + np.random.default_rng(0).normal(0, 0.02, (len(X), 2))
    y[:, 0] += 1.0 * np.abs(motion[1][:, 0]) ** 2.5 * np.sign(motion[1][:, 0])
    model = RBDRegressor(robot, ("viscous", ("nonlinear_viscous", [1])))
    diagnosis = diagnose(model, X, y, checks=(), effects=[])
    problem, noise = diagnosis.problem, diagnosis.result.fit.noise
    (term,) = [t for t in problem.terms if t.kind == "nonlinear_viscous"]
    terms = [t.with_shape(power=2.5) if t is term else t for t in problem.terms]
    free, held = (
        {t.kind: v for t, v in parameter_intervals(problem, terms, noise, shapes).items()}
        for shapes in (True, False)
    )
    (value, low, _) = held["nonlinear_viscous"]["c"]
    assert low > 0
    (same, least, most) = free["nonlinear_viscous"]["c"]
    assert same == value
    assert 0 < least < 1.0 < most
    assert most - value > value  # an interval that is symmetric about the value would contain zero


def test_a_load_whose_mass_may_be_zero_has_first_moments_and_no_center_of_mass():
    robot = load_ur5()
    log = make_hidden_effect_log(robot, None, n_trajectories=6, duration=5.0, random_state=1)
    q, dq, ddq = (
        log.X[[f"{symbol}{k + 1}" for k in range(6)]].to_numpy() for symbol in ("q", "dq", "ddq")
    )
    load = np.zeros(10 * robot.n_bodies)
    load[-9:-6] = 0.2, -0.3, 0.4
    carried = log.X["trajectory"].to_numpy() < 3
    torque = np.array(log.y)
    torque[carried] += (robot.torque_regressor(q, dq, ddq) @ load)[carried]

    (finding,) = diagnose(
        RBDRegressor(robot), log.X, torque, effects=["payload"], checks=()
    ).findings

    moments = [finding.parameters[f"first_moment_{axis}"]["value"] for axis in "xyz"]
    assert finding.kind == "payload" and set(finding.parameters) == {
        f"first_moment_{axis}" for axis in "xyz"
    }
    np.testing.assert_allclose(moments, load[-9:-6], atol=0.1)
