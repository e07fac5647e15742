# SPDX-License-Identifier: BSD-3-Clause
"""The first screen of a diagnosis."""

import dataclasses

import numpy as np

from skidyn.measurement import Suspicion


def test_says_what_is_missing_and_where_in_the_headline(missing):
    story = missing.story()
    assert story["headline"] == "Missing: spring on joint 2"
    (line,) = story["findings"]
    assert line["where"] == "joint 2" and line["size"].startswith("k = ")
    assert "±" in line["size"] and "N m/rad" in line["size"]


def test_numbers_are_those_of_the_diagnosis(missing):
    rows = missing.story()["joints"]
    assert [row["before"] for row in rows] == list(missing.rmse_before)
    assert [row["after"] for row in rows] == list(missing.rmse_after)
    assert rows[1]["speaks"] and rows[1]["state"] == "better"
    assert " → " in rows[1]["text"] and "noise" in rows[1]["text"]


def test_a_complete_model_has_nothing_to_say(complete):
    story = complete.story()
    assert story["headline"] == "Nothing significant is missing"
    assert story["findings"] == [] and "at the noise level" in story["text"]
    assert complete.failures == []


def test_an_error_above_the_noise_is_said(complete):
    noisy = dataclasses.replace(complete, noise_floor=complete.rmse_after / 3)
    story = noisy.story()
    assert "exceeds the noise" in story["text"]
    assert "3.0 times the noise" in story["left"] and "healthy robots" in story["left"]


def test_a_material_remainder_is_never_called_complete(complete):
    parts = dataclasses.replace(complete.parts, material=np.array([False, True]))
    story = dataclasses.replace(complete, parts=parts, verdict="unknown").story()
    assert story["headline"] == "An unknown effect is missing on joint 2"
    assert story["mark"] == "?"


def test_rivals_are_said_with_the_name(missing):
    finding = dataclasses.replace(missing.findings[0], rivals=("gravity_compensator",))
    story = dataclasses.replace(missing, findings=[finding]).story()
    assert "cannot separate it from gravity compensator" in story["findings"][0]["sure"]
    assert story["findings"][0]["doubtful"]


def test_a_joint_that_gets_worse_is_flagged(missing):
    history = [dict(step, rmse=list(step["rmse"])) for step in missing.history]
    history[-1]["rmse"][0] = 1.5 * history[0]["rmse"][0]
    rows = dataclasses.replace(missing, history=history).story()["joints"]
    assert rows[0]["state"] == "worse" and rows[0]["speaks"]


def test_unknown_noise_leaves_numbers_out(missing):
    story = dataclasses.replace(missing, noise_floor=np.full(2, np.nan)).story()
    assert "noise –" in story["joints"][1]["text"]


def test_when_a_torque_comes_and_goes_is_said(pushed):
    (line,) = pushed.story()["findings"]
    (episode,) = pushed.findings[0].when
    assert line["when"] == f"acts from {episode.start:.1f} to {episode.end:.1f} s of trajectory 3"


def test_how_an_effect_changes_is_said(missing):
    ends = [(k, 0.0, 1 - 0.1 * k, 6.0, 0.9 - 0.1 * k) for k in range(3)]
    term = missing.findings[0].terms[0].with_shape(course=tuple(ends))
    finding = dataclasses.replace(missing.findings[0], terms=(term,))
    (line,) = dataclasses.replace(missing, findings=[finding]).story()["findings"]
    assert line["when"] == "falls steadily over the log, from the stated size to 70% of it"


def test_confidence_is_said_where_it_is_known(missing):
    finding = dataclasses.replace(missing.findings[0], confidence=0.62)
    line = dataclasses.replace(missing, findings=[finding]).story()["findings"][0]
    assert "confidence 62%" in line["sure"] and line["doubtful"]


def test_a_name_that_is_hardly_sure_is_called_a_guess(missing):
    finding = dataclasses.replace(missing.findings[0], confidence=0.2)
    story = dataclasses.replace(missing, findings=[finding]).story()
    assert story["headline"] == "An effect is missing on joint 2; most likely: spring on joint 2"
    assert story["mark"] == "?"


def test_sizes_of_several_joints_are_those_of_a_parameter_that_is_not_zero(missing):
    k = {"value": 0.1, "low": -0.4, "high": 0.6, "unit": "N m/rad"}
    c = {"value": 2.0, "low": 1.6, "high": 2.4, "unit": "N m/rad^3"}
    finding = dataclasses.replace(missing.findings[0], parameters={"k1": k, "k3": c})
    other = dataclasses.replace(finding, joints=(1,))
    history = [missing.history[0], {**missing.history[1], "joints": [1, 2]}]
    story = dataclasses.replace(missing, findings=[finding, other], history=history).story()
    (line,) = story["findings"]
    assert line["size"].startswith("k3 = 2.00 ± 0.40") and "k1" not in line["size"]


def test_a_guess_beside_a_sure_name_does_not_lead_the_headline(missing):
    sure = missing.findings[0]
    guess = dataclasses.replace(sure, kind="viscous", title="Viscous friction", confidence=0.1)
    story = dataclasses.replace(missing, findings=[guess, sure]).story()
    assert story["headline"] == "Missing: spring on joint 2; possibly viscous friction on joint 2"


def told(missing, *found):
    """The story of findings in their order: kind, joint and confidence."""
    findings = [
        dataclasses.replace(
            missing.findings[0], kind=kind, title=kind, joints=(joint,), confidence=sure
        )
        for kind, joint, sure in found
    ]
    kinds = dict.fromkeys(kind for kind, *_ in found)
    steps = [{**missing.history[1], "added": kind, "joints": [1, 2]} for kind in kinds]
    history = [missing.history[0], *steps]
    return dataclasses.replace(missing, findings=findings, history=history).story()


def test_a_joint_with_a_confidence_below_one_half_is_not_counted_as_missing(missing):
    ripple = ("torque_ripple", 1, 0.18), ("torque_ripple", 2, 0.9)
    story = told(missing, *ripple, ("spring", 2, 0.8), ("viscous", 2, 0.3))
    assert story["headline"].startswith("2 known effects are missing, the largest being ")
    assert story["headline"].endswith("; 2 more are uncertain")
    lines = [(line["kind"], line["joints"], line["guess"]) for line in story["findings"]]
    assert lines == [
        ("torque_ripple", [2], False),
        ("spring", [2], False),
        ("torque_ripple", [1], True),
        ("viscous", [2], True),
    ]


def test_the_confidence_of_joints_in_one_line_is_a_range(missing):
    (line,) = told(missing, ("spring", 1, 0.62), ("spring", 2, 0.95))["findings"]
    assert line["sure"].startswith("confidence 62% to 95%")


def test_the_headline_counts_effects_in_words(missing):
    steps = missing.history[0]["rmse"], missing.history[1]["rmse"]
    unknown = dataclasses.replace(missing.findings[0], kind="unknown", title="Unknown torque")
    history = [{"added": None, "joints": [], "rmse": rmse} for rmse in steps]  # a line each
    one = dataclasses.replace(missing.findings[0], kind="viscous", confidence=0.1)

    def headline(*found):
        return dataclasses.replace(missing, findings=[*found], history=history).story()["headline"]

    assert headline(unknown, unknown, unknown).startswith(
        "3 unknown effects are missing, the largest being "
    )
    assert headline(unknown, one, one).startswith("An unknown effect is missing: unknown")
    assert headline(missing.findings[0], one, one).startswith("1 known effect is missing: spring")


def test_nothing_is_judged_beside_a_doubt_that_could_hide_an_effect(complete):
    doubt = Suspicion("torque_scale", "torques look like currents", "10 times", "suspected")
    story = dataclasses.replace(complete, checks=[doubt]).story()
    assert story["headline"] == "No effect is judged until this doubt about the log is resolved"
    slight = dataclasses.replace(doubt, check="coarse_position", certainty="noted")
    story = dataclasses.replace(complete, checks=[slight]).story()
    assert story["headline"] == "Nothing significant is missing"


def test_other_joints_that_explain_as_much_are_a_clause(missing):
    finding = dataclasses.replace(missing.findings[0], confidence=0.33, elsewhere=((1,),))
    (line,) = dataclasses.replace(missing, findings=[finding]).story()["findings"]
    assert line["sure"].startswith(
        "confidence 33% that it acts on this joint; on joint 1, it would"
    )
