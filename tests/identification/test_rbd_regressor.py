# SPDX-License-Identifier: BSD-3-Clause
import pickle
import re
from dataclasses import replace
from importlib import resources
from importlib.resources import files

import numpy as np
import pandas as pd
import polars
import pytest
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, GroupKFold, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils.estimator_checks import parametrize_with_checks

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import Term
from skidyn.exceptions import ColumnError
from skidyn.identification import RBDRegressor, is_consistent
from skidyn.model_selection import TrajectoryKFold
from skidyn.robots import Robot

ONE_JOINT = """<robot name="pendulum"><link name="base"/>
<link name="rod"><inertial><origin xyz="0.2 0 0"/><mass value="1.5"/>
<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="50" velocity="3"/></joint></robot>"""
HIDDEN = make_hidden_effect_log(
    load_planar_arm(), "stribeck", joints=[2], n_trajectories=6, duration=8.0, rate=100.0
)
TEXT = (files("skidyn.datasets") / "robots" / "planar_arm.urdf").read_text()


class AnyColumns(RBDRegressor):
    """Takes whatever columns and targets scikit-learn's checks bring; for tests only."""

    def _resolve(self, n_features):
        n = self.robot_.n_joints
        at = tuple(k % n_features for k in range(3 * n))
        usual = super()._resolve(3 * n)
        return replace(usual, q=at[:n], dq=at[n : 2 * n], ddq=at[2 * n :])

    def __sklearn_tags__(self):
        # A pendulum does not follow the made-up data of the checks.
        tags = super().__sklearn_tags__()
        tags.regressor_tags.poor_score = True
        return tags


EXPECTED = {
    "check_regressor_multioutput": "the robot and not y says how many outputs there are",
}
ROBUST = {
    "check_sample_weight_equivalence_on_dense_data": (
        "rows are judged by their weighted residual, which copies of a row do not change"
    ),
}


@parametrize_with_checks(
    [
        AnyColumns(Robot.from_urdf(ONE_JOINT), estimator=name, consistent=name == "weighted")
        for name in ("weighted", "robust", "entropic")
    ],
    expected_failed_checks=lambda estimator: (
        EXPECTED | (ROBUST if estimator.estimator == "robust" else {})
    ),
)
def test_scikit_learn_contract(estimator, check):
    check(estimator)


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), None, n_trajectories=4, duration=5.0, random_state=1
    )


@pytest.fixture(scope="module")
def model(log):
    return RBDRegressor(log.robot).fit(log.X, log.y)


@pytest.fixture(scope="module")
def exact():
    """Motion and torque of another planar arm than the URDF's, without noise."""
    robot = load_planar_arm()
    rng = np.random.default_rng(0)
    truth = robot.inertial_parameters * rng.uniform(0.8, 1.2, (robot.n_bodies, 1))
    X = rng.uniform(-2, 2, (600, 6))
    y = robot.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:], parameters=truth)
    return robot, truth, X, y + 0.3 * X[:, 2:4] + 0.5 * np.tanh(X[:, 2:4] / 0.003)


def test_order_of_columns_does_not_matter(log, model):
    shuffled = log.X[list(np.random.default_rng(0).permutation(log.X.columns))]
    other = RBDRegressor(log.robot).fit(shuffled, log.y)
    np.testing.assert_allclose(other.predict(shuffled), model.predict(log.X), atol=1e-9)
    with pytest.raises(ValueError, match="feature names"):
        model.predict(shuffled)


def test_polars(log, model):
    X = polars.DataFrame({name: log.X[name].to_numpy() for name in log.X.columns})
    np.testing.assert_allclose(model.predict(X), model.predict(log.X))
    assert RBDRegressor(log.robot).fit(X, log.y).score(X, log.y) > 0.9


def test_clone_and_pickle(log, model):
    again = clone(model).fit(log.X, log.y)
    np.testing.assert_allclose(again.predict(log.X), model.predict(log.X))
    copy = pickle.loads(pickle.dumps(model))
    np.testing.assert_allclose(copy.predict(log.X), model.predict(log.X))


def test_searches_over_effects_in_a_pipeline(log):
    pipe = make_pipeline(FunctionTransformer(), RBDRegressor(log.robot))
    grid = {"rbdregressor__effects": [(), ("viscous", "coulomb")]}
    search = GridSearchCV(pipe, grid, cv=TrajectoryKFold(n_splits=2)).fit(log.X, log.y)
    assert search.best_params_["rbdregressor__effects"] == ("viscous", "coulomb")


def test_folds_of_trajectories(log):
    groups = log.X["trajectory"]
    model = RBDRegressor(log.robot)
    one = cross_val_score(model, log.X, log.y, cv=GroupKFold(2), groups=groups)
    two = cross_val_score(model, log.X, log.y, cv=TrajectoryKFold(n_splits=2))
    assert min(one) > 0.8 and min(two) > 0.8


def test_errors_name_what_is_wrong(log):
    model = RBDRegressor(log.robot)
    with pytest.raises(ColumnError, match="1 column"):
        model.fit(log.X, log.y[:, :1] if isinstance(log.y, np.ndarray) else log.y.iloc[:, :1])
    state = log.X.drop(columns=[c for c in log.X if c.startswith("ddq") or c == "time"])
    with pytest.raises(ColumnError, match="neither accelerations nor time"):
        model.fit(state, log.y)
    with pytest.raises(ValueError, match="identified"):
        RBDRegressor(log.robot, parameters="guessed").fit(log.X, log.y)


def test_exact_data_gives_the_exact_model(exact):
    robot, truth, X, y = exact
    model = RBDRegressor(robot).fit(X, y)
    q, dq, ddq = np.random.default_rng(5).uniform(-3, 3, (3, 50, 2))
    expected = robot.inverse_dynamics(q, dq, ddq, parameters=truth)
    np.testing.assert_allclose(model.rigid_body_torque(q, dq, ddq), expected, atol=1e-6)
    coefficients = [float(c[0]) for c in model.effect_coefficients_.values()]
    np.testing.assert_allclose(sorted(coefficients), [0.3, 0.3, 0.5, 0.5], atol=1e-6)


def test_same_as_least_squares_with_pinocchio(exact):
    pin = pytest.importorskip("pinocchio")
    robot, _, X, y = exact
    text = resources.files("skidyn.datasets").joinpath("robots", "planar_arm.urdf").read_text()
    oracle = pin.buildModelFromXML(text)
    data = oracle.createData()

    def columns(rows):
        blocks = []
        for x in rows:
            rigid = pin.computeJointTorqueRegressor(oracle, data, x[:2], x[2:4], x[4:])
            blocks.append(np.hstack([rigid, np.diag(x[2:4]), np.diag(np.tanh(x[2:4] / 0.003))]))
        return np.vstack(blocks)

    solution = np.linalg.lstsq(columns(X), y.ravel(), rcond=1e-10)[0]
    new = np.random.default_rng(6).uniform(-2, 2, (40, 6))
    prediction = RBDRegressor(robot).fit(X, y).predict(new)
    np.testing.assert_allclose(prediction.ravel(), columns(new) @ solution, atol=1e-6)


def test_nominal_parameters_stay(exact):
    robot, _, X, y = exact
    model = RBDRegressor(robot, parameters="nominal").fit(X, y)
    np.testing.assert_array_equal(model.inertial_parameters_, robot.inertial_parameters)
    assert len(model.coef_) == 4


@pytest.mark.parametrize("seed", range(20))
def test_consistent_even_on_pure_noise(seed):
    rng = np.random.default_rng(seed)
    X, y = rng.uniform(-2, 2, (120, 6)), rng.normal(0, 10.0 ** rng.uniform(-2, 2), (120, 2))
    model = RBDRegressor(load_planar_arm(), consistent=True).fit(X, y)
    assert is_consistent(model.inertial_parameters_)
    assert all(np.all(c >= 0) for c in model.effect_coefficients_.values())


def test_intervals_cover_the_truth(exact):
    robot, _, X, y = exact
    inside = []
    for seed in range(15):
        noise = np.random.default_rng(seed).normal(0, 0.2, y.shape)
        model = RBDRegressor(robot).fit(X, y + noise)
        std = dict(zip(model.coef_names_, model.coef_std_, strict=True))
        for j in (1, 2):
            for name, truth in ((f"viscous.Fv[{j}]", 0.3), (f"coulomb.Fc[{j}]", 0.5)):
                value = model.coef_[model.coef_names_.index(name)]
                inside.append(abs(value - truth) < 2.5 * std[name])
    assert np.mean(inside) > 0.85


def swings(amplitudes, speeds, centres):
    """A pendulum with friction that depends on its position, one recording an amplitude."""
    robot, t, frames = Robot.from_urdf(ONE_JOINT), np.arange(400) * 0.01, []
    for k, (a, w, c) in enumerate(zip(amplitudes, speeds, centres, strict=True)):
        wave = a * np.sin(w * t)
        motion = {"q1": c + wave, "dq1": a * w * np.cos(w * t), "ddq1": -w * w * wave}
        frames.append(pd.DataFrame({"trajectory": k, "time": t, **motion}))
    X = pd.concat(frames, ignore_index=True)
    q, dq, ddq = (X[[name]].to_numpy() for name in ("q1", "dq1", "ddq1"))
    friction = 0.3 * np.sin(3 * q) * np.tanh(dq)
    noise = 0.02 * np.random.default_rng(0).normal(size=q.shape)
    return X, robot.inverse_dynamics(q, dq, ddq) + friction + noise


@pytest.mark.parametrize("estimator", ["weighted", "ordinary", "robust", "entropic"])
def test_a_function_of_several_signals_holds_beside_the_places_that_the_log_fills(estimator):
    X, y = swings(
        [0.3, 0.35, 0.4, 0.3, 0.5, 0.4], [2, 3, 2.5, 4, 2, 3], [-0.6, -0.3, 0, 0.2, 0.4, 0.1]
    )
    beside = swings([0.3, 0.3], [3, 3], [0.6, -0.6])
    beyond = swings([0.3, 0.3], [5, 4.5], [0.9, -0.9])
    ends = [(-0.9, 0.8), (-1.2, 1.2), (-4.5, 4.5)]
    shape = {
        "of": ("q1", "dq1", "ddq1"),
        "knots": tuple(tuple(np.linspace(*end, 4)) for end in ends),
    }
    term, errors = Term("function_of_three_signals", (1,), shape), []
    for more in ([], [term]):
        model = RBDRegressor(
            Robot.from_urdf(ONE_JOINT), ["viscous", "coulomb", *more], estimator=estimator
        )
        model.fit(X, y)
        errors.append([np.std(model.predict(Z) - target) for Z, target in (beside, beyond)])
    without, with_it = errors
    assert with_it[0] < 0.4 * without[0]
    assert with_it[1] < 1.3 * without[1]  # half of it is outside the range of any recording


@pytest.fixture(scope="module")
def rubbing():
    return make_hidden_effect_log(load_planar_arm(), "stribeck", n_trajectories=2, duration=3.0)


@pytest.fixture(scope="module")
def rubs(rubbing):
    return RBDRegressor(rubbing.robot, ("viscous", "coulomb", "stribeck")).fit(rubbing.X, rubbing.y)


def same(loaded, model, X):
    assert np.array_equal(loaded.predict(X), model.predict(X))
    assert list(loaded.effect_coefficients_) == list(model.effect_coefficients_)
    for key, factor in model.evidence_.factors.items():
        assert np.array_equal(loaded.evidence_.factors[key], factor)


def test_skops_stores_a_fitted_model(rubs, rubbing):
    skops = pytest.importorskip("skops.io")
    data = skops.dumps(rubs)
    same(skops.loads(data, trusted=skops.get_untrusted_types(data=data)), rubs, rubbing.X)


def test_pickle_of_fitted_and_unfitted(rubs, rubbing):
    same(pickle.loads(pickle.dumps(rubs)), rubs, rubbing.X)
    unfitted = pickle.loads(pickle.dumps(RBDRegressor(rubbing.robot)))
    assert not hasattr(unfitted, "coef_")


def test_a_single_sample_is_refused_or_exact():
    robot = load_planar_arm()
    x = np.array([[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]])
    model = RBDRegressor(robot, effects=(), smooth=False)
    y = robot.inverse_dynamics(x[:, :2], x[:, 2:4], x[:, 4:])
    try:
        assert np.isfinite(model.fit(x, y).predict(x)).all()
    except ValueError as error:
        assert "sample" in str(error) or "row" in str(error)


def test_missing_values_are_refused_by_the_model():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    X = log.X.copy()
    X.iloc[100, 3] = np.nan
    with pytest.raises(ValueError, match="NaN"):
        RBDRegressor(log.robot).fit(X, log.y)


@pytest.mark.slow
def test_a_trajectory_of_a_million_rows_is_fitted_exactly():
    robot = load_planar_arm()
    t = np.arange(1_000_000) / 1000.0
    q = np.column_stack([np.sin(0.7 * t) + 0.3 * np.sin(2.1 * t), np.sin(1.3 * t + 1)])
    dq = np.column_stack(
        [0.7 * np.cos(0.7 * t) + 0.63 * np.cos(2.1 * t), 1.3 * np.cos(1.3 * t + 1)]
    )
    ddq = np.column_stack(
        [-0.49 * np.sin(0.7 * t) - 1.323 * np.sin(2.1 * t), -1.69 * np.sin(1.3 * t + 1)]
    )
    y = robot.inverse_dynamics(q, dq, ddq) + 2.0 * dq
    X = np.column_stack([t, q, dq, ddq])
    model = RBDRegressor(robot, ("viscous",), smooth=False, time=0).fit(X, y)
    np.testing.assert_allclose(model.coef_[-2:], 2.0, rtol=1e-8)


def scaled(mass=1.0, length=1.0):
    """The arm with masses in other units, and lengths in others."""

    def change(match):
        power = {"mass value": 0, "xyz": 1}.get(match[1], 2)
        weight = 1.0 if match[1] == "xyz" else mass
        numbers = [float(x) * weight * length**power for x in match[2].split()]
        return f'{match[1]}="{" ".join(map(repr, numbers))}"'

    inertial = re.sub(r'(mass value|i[xyz]{2})="([^"]+)"', change, TEXT)
    text = re.sub(r'(?<=origin )(xyz)="([^"]+)"', change, inertial)
    return Robot.from_urdf(text, gravity=(0.0, 0.0, -9.81 * length))


@pytest.fixture(scope="module")
def reference():
    return RBDRegressor(load_planar_arm()).fit(HIDDEN.X, HIDDEN.y)


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 1e3, 1e6])
def test_robots_from_a_milligram_to_thousands_of_tonnes(reference, factor):
    model = RBDRegressor(scaled(mass=factor)).fit(HIDDEN.X, HIDDEN.y * factor)
    assert model.coef_names_ == reference.coef_names_
    np.testing.assert_allclose(model.coef_ / factor, reference.coef_, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(model.coef_std_ / factor, reference.coef_std_, rtol=1e-4, atol=1e-9)
    assert model.condition_number_ == pytest.approx(reference.condition_number_, rel=1e-3)


@pytest.mark.parametrize("length", [1e-3, 1e3])
def test_millimetres_and_kilometres(reference, length):
    """Lengths in other units, gravity too: torque grows with their square."""
    model = RBDRegressor(scaled(length=length)).fit(HIDDEN.X, HIDDEN.y * length**2)
    np.testing.assert_allclose(
        model.predict(HIDDEN.X) / length**2, reference.predict(HIDDEN.X), rtol=1e-6, atol=1e-6
    )


def test_only_ratios_of_weights_count_and_trajectories_without_weight_do_not():
    log = make_hidden_effect_log(load_planar_arm(), "stribeck", n_trajectories=6, duration=3.0)
    model = RBDRegressor(log.robot)
    n = len(log.X)
    one, less = (model.fit(log.X, log.y, sample_weight=np.full(n, w)).coef_ for w in (1.0, 1.0 / n))
    np.testing.assert_allclose(less, one, rtol=1e-9)
    kept = (log.X["trajectory"] <= 3).to_numpy()
    weighted = model.fit(log.X, log.y, sample_weight=kept.astype(float)).coef_
    np.testing.assert_allclose(weighted, model.fit(log.X[kept], log.y[kept]).coef_, rtol=1e-9)


def test_motion_without_what_a_fit_needs_is_refused():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    X, y, robot = log.X, log.y, log.robot
    with pytest.raises(ColumnError, match="smooth=True"):
        RBDRegressor(robot, smooth=True).fit(X.drop(columns=["time", "trajectory"]), y)
    with pytest.raises(ColumnError, match="another order than the joints"):
        RBDRegressor(robot).fit(X, log.frame[["tau2", "tau1"]])
    with pytest.raises(ColumnError, match="equal to those of the row before"):
        RBDRegressor(robot).fit(X.assign(time=0.0), y)
    with pytest.raises(ColumnError, match="column 'dq2' of X is NaN in row 7"):
        RBDRegressor(robot).fit(X.assign(dq2=X["dq2"].where(X.index != 7)), y)
    bare = X.drop(columns=["ddq1", "ddq2"], errors="ignore")
    fitted = RBDRegressor(robot).fit(bare, y)
    with pytest.raises(ColumnError, match="no neighbour in time"):
        fitted.predict(bare[:1])


@pytest.mark.parametrize(
    ("effect", "told"),
    [("torque_ripple", "shape parameter N"), ("temperature_friction", "temp1")],
)
def test_effects_that_a_fit_cannot_search_or_see_are_refused(effect, told):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    with pytest.raises(ValueError, match=told):
        RBDRegressor(log.robot, ("viscous", effect)).fit(log.X, log.y)


def test_effects_may_not_change_between_parts():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    model = RBDRegressor(log.robot).partial_fit(log.X, log.y).set_params(effects=("viscous",))
    with pytest.raises(ValueError, match="were changed after its first part"):
        model.partial_fit(log.X, log.y)
