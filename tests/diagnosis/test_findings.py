# SPDX-License-Identifier: BSD-3-Clause
"""A finding in numbers, words and curves."""

import json

import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose, notes
from skidyn.diagnosis._findings import effect_curves, told_briefly
from skidyn.effects import Term
from skidyn.identification import RBDRegressor


def test_words_and_numbers_are_the_same(missing):
    (finding,) = missing.findings
    assert finding.sentence.startswith("Spring on joint 2: k = ")
    assert f"removes {finding.error_drop:.0%} of the held-out squared error" in finding.sentence
    assert finding.code == 'model = diagnosis.add("spring", joints=[2])'
    told = json.loads(json.dumps(finding.to_dict()))
    assert (told["kind"], told["joints"]) == ("spring", [2])


def test_the_interval_holds_the_truth(missing, spring_log):
    stiffness = missing.findings[0].parameters["k"]
    assert stiffness["low"] < float(np.ravel(spring_log.parameters["k"])[0]) < stiffness["high"]
    assert stiffness["unit"] == "N m/rad"


def test_the_curve_is_that_of_a_spring(missing):
    (curve,) = missing.findings[0].curves
    assert (curve["variable"], curve["unit"]) == ("q2", "rad")
    slope = np.polyfit(curve["x"], curve["effect"], 1)[0]
    assert (
        slope == np.float64(slope)
        and abs(slope / missing.findings[0].parameters["k"]["value"] - 1) < 0.05
    )
    assert (curve["low"] <= curve["high"]).all()


def test_an_unknown_torque_is_drawn_over_a_signal_on_which_it_depends(missing):
    problem, term = missing.problem, Term("friction_over_position", (1,))
    torque, residual = {term: {0: problem.signals.dq[:, 0]}}, 0 * problem.torque
    drawn = {
        variables: effect_curves(problem, [term], torque, residual, variables)[0]
        for variables in ((), ("dq1",), ("dq1", "q1"), ("dq2",), ("tool position",))
    }
    told = [curve["variable"] for curve in drawn.values()]
    assert told == ["q1", "dq1", "q1", "dq2", "q1"]
    assert drawn["dq1",]["unit"] == "rad/s"
    np.testing.assert_allclose(drawn["dq1",]["effect"], drawn["dq1",]["x"])


def test_the_known_effect_that_comes_closest_to_an_unknown_torque():
    log = make_hidden_effect_log(
        load_planar_arm(), None, n_trajectories=6, duration=6.0, random_state=1
    )
    q = log.X["q2"].to_numpy()
    bump = 1.5 * q + np.exp(-(((q - 0.3) / 0.1) ** 2))
    torque = log.y + np.column_stack([0 * q, bump])

    diagnosis = diagnose(RBDRegressor(log.robot), log.X, torque)

    (finding,) = diagnosis.findings
    assert finding.kind == "unknown" and finding.variables == ("q2",)
    assert "spring" in finding.nearest["kind"] and 0.5 < finding.nearest["share"] < 1
    assert "Of the known effects" in finding.sentence
    assert finding.to_dict()["nearest"] == finding.nearest


def test_a_mass_below_zero_is_explained():
    assert "description includes a load" in notes("payload", {"mass": {"value": -1.0}})[-1]


def test_a_ripple_is_told_as_gear_ratio_or_lead():
    def rows(waves, unit):
        return {"N": {"value": waves, "unit": unit}, "A": {"value": 0.16, "unit": "N m"}}

    assert "if it is 101." in notes("torque_ripple", rows(202.0, "1/rad"))[-1]
    assert "every 5 mm" in notes("torque_ripple", rows(2e3 * np.pi / 5, "1/m"))[-1]


def test_the_first_size_that_is_certain_is_told_and_no_shape():
    def row(value, half):
        ends = (None, None) if half is None else (value - half, value + half)
        return {"value": value, "low": ends[0], "high": ends[1], "unit": "N m"}

    drift = {"dFv": row(0.016, 0.012), "dFc": row(-1.407, 0.028)}
    assert ": dFc = " in told_briefly("Friction drift", (1,), None, drift)
    ripple = {"A": row(0.149, 0.08), "N": row(201.9, 0.36)}
    assert ": A = " in told_briefly("Torque ripple", (4,), None, ripple, {"N"})
    spring = {"k1": row(1.9, 0.7), "q_middle": row(0.1, None)}
    assert ": k1 = " in told_briefly("Nonlinear spring", (2,), None, spring)
