# SPDX-License-Identifier: BSD-3-Clause
"""A log of the suite is simulated alike every time."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the suite is simulated by MuJoCo")
pytest.importorskip("pandas")
from skidyn.datasets import SuiteCase, load_planar_arm
from skidyn.identification import RBDRegressor


def planar_case(content, *kinds, tier="short"):
    return SuiteCase("case_007", "planar_arm", tier, content, kinds, (3, 7))


@pytest.fixture(scope="module")
def empty():
    return planar_case("nothing").make()


def test_a_log_comes_out_the_same_again(empty):
    again = planar_case("nothing").make()
    np.testing.assert_array_equal(empty.frame.to_numpy(), again.frame.to_numpy())


def test_a_log_that_hides_nothing_is_explained_by_the_base_model(empty):
    """Noise is all that is left: MuJoCo and skidyn agree on rigid bodies and drives."""
    frame, truth = empty.frame, empty.truth
    assert truth["effects"] == [] and not truth["detectable"]
    model = RBDRegressor(load_planar_arm(), ("viscous", "coulomb", "rotor_inertia"))
    tau = frame[["tau1", "tau2"]].to_numpy()
    signals = frame.drop(columns=["tau1", "tau2"])
    motion = planar_motion(signals)
    moves = (np.abs(frame[["dq1", "dq2"]]) > 0.1).all(axis=1).to_numpy()
    left = (tau - model.fit(motion[moves], tau[moves]).predict(motion))[moves]
    assert (left.std(axis=0) < 3 * np.array(truth["noise_std"])).all()


def planar_motion(frame):
    """The log with accelerations from differences over 50 ms, which noise needs."""
    out = frame[["time", "trajectory", "q1", "q2", "dq1", "dq2"]].copy()
    for j in (1, 2):
        parts = []
        for _, run in frame.groupby("trajectory"):
            smooth = run[f"dq{j}"].rolling(7, center=True, min_periods=1).mean()
            parts.append(np.gradient(smooth.to_numpy(), run["time"].to_numpy()))
        out[f"ddq{j}"] = np.concatenate(parts)
    return out


@pytest.mark.parametrize(
    ("content", "kind"),
    [("one", "spring"), ("nameless", "narrow_bump"), ("one", "viscous")],
)
def test_an_effect_stands_out_of_the_noise(content, kind):
    truth = planar_case(content, kind).make().truth
    (effect,) = truth["effects"]
    assert effect["kind"] == ("unknown" if content == "nameless" else kind)
    assert truth["detectable"]
    assert set(effect["joints"]) <= {1, 2}
    assert ("viscous" in truth["base_model"]) == (kind != "viscous")
