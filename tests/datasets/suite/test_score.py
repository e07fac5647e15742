# SPDX-License-Identifier: BSD-3-Clause
"""Scores of plain answers."""

import pytest

from skidyn.datasets import score_answers, wilson_interval
from skidyn.exceptions import SkidynError


def truth(*effects, name="case_000", content="one", required=(2,), detectable=True):
    defaults = {
        "accept": [],
        "anywhere": False,
        "variables": [],
        "scored_parameters": [],
        "parameters": {},
    }
    return {
        "case": name,
        "content": content,
        "tier": "low",
        "effects": [defaults | e for e in effects],
        "joints_required": list(required),
        "detectable": detectable,
    }


def answer(*effects, name="case_000", verdict="missing"):
    return {"case": name, "verdict": verdict, "effects": list(effects)}


def one(truths, answers):
    return score_answers([truths], [answers]).cases[0]


DAHL = {"kind": "dahl", "joints": [2, 4], "accept": ["lugre"]}


def test_silence_is_right_where_nothing_is_hidden_and_wrong_elsewhere():
    nothing = truth(content="nothing", required=(), detectable=False)
    assert one(nothing, answer(verdict="complete"))["clean"] == 1
    false = one(nothing, answer({"kind": "spring", "joints": [1]}))
    assert (false["solved"], false["false_claims"]) == (0, 1)
    assert one(truth(DAHL), answer(verdict="complete"))["solved"] == 0


def test_a_name_counts_on_the_right_joints():
    hidden = truth(DAHL, required=(2, 4))
    assert one(hidden, answer({"kind": "dahl", "joints": [2, 4]}))["clean"] == 1
    assert one(hidden, answer({"kind": "lugre", "joints": [2, 4]}))["clean"] == 1
    assert one(hidden, answer({"kind": "dahl", "joints": [1, 3]}))["solved"] == 0
    assert one(hidden, answer({"kind": "dahl", "joints": [2]}))["solved"] == 0
    assert one(truth(DAHL, required=(2,)), answer({"kind": "dahl", "joints": [2]}))["solved"] == 1


def test_claims_of_one_kind_joint_by_joint_count_together():
    hidden = truth(DAHL, required=(2, 4))
    said = answer({"kind": "dahl", "joints": [2]}, {"kind": "dahl", "joints": [4]})
    assert one(hidden, said)["clean"] == 1


def test_the_first_claim_decides_and_others_are_false():
    spring = {"kind": "spring", "joints": [1]}
    dahl = {"kind": "dahl", "joints": [2, 4]}
    assert one(truth(DAHL), answer(spring, dahl))["solved"] == 0
    later = one(truth(DAHL), answer(dahl, spring))
    assert (later["solved"], later["clean"], later["false_claims"]) == (1, 0, 1)


def test_of_two_effects_both_are_wanted():
    hidden = truth(DAHL, {"kind": "spring", "joints": [1]}, content="two", required=(1, 2, 4))
    both = answer({"kind": "spring", "joints": [1]}, {"kind": "dahl", "joints": [2, 4]})
    assert one(hidden, both)["clean"] == 1
    assert one(hidden, answer({"kind": "spring", "joints": [1]}))["solved"] == 0


def test_a_nameless_torque_wants_its_signals():
    hidden = truth(
        {"kind": "unknown", "joints": [2], "variables": ["q2", "q3"]}, content="nameless"
    )
    said = {"kind": "unknown", "joints": [2], "variables": ["q2", "q3", "dq1"]}
    assert one(hidden, answer(said, verdict="unknown"))["solved"] == 1
    said = {"kind": "unknown", "joints": [2], "variables": ["dq5"]}
    assert one(hidden, answer(said, verdict="unknown"))["solved"] == 0


def test_an_effect_of_one_trajectory_wants_that_trajectory():
    hidden = truth({"kind": "spring", "joints": [2], "trajectories": [4]}, content="once")
    claim = {"kind": "spring", "joints": [2]}
    assert one(hidden, answer(claim | {"trajectories": [4]}))["solved"] == 1
    assert one(hidden, answer(claim))["solved"] == 0
    assert one(hidden, answer(claim | {"trajectories": [3]}))["solved"] == 0


def test_parameters_are_compared_joint_by_joint():
    hidden = truth(
        {
            "kind": "spring",
            "joints": [2, 4],
            "parameters": {"k": [10.0, 20.0]},
            "scored_parameters": ["k"],
        },
        required=(2, 4),
    )
    together = {"kind": "spring", "joints": [4, 2], "parameters": {"k": [22.0, 9.0]}}
    assert one(hidden, answer(together))["parameter_error"] == pytest.approx(0.1)
    apart = [
        {"kind": "spring", "joints": [j], "parameters": {"k": v}} for j, v in ((2, 9), (4, 22))
    ]
    assert one(hidden, answer(*apart))["parameter_error"] == pytest.approx(0.1)


def test_what_drowns_in_noise_counts_for_false_claims_only():
    hidden = truth(DAHL, detectable=False)
    score = score_answers([hidden], [answer({"kind": "spring", "joints": [1]})])
    whole = score.table[-1]
    assert (whole["group"], whole["n"], whole["false_claims"]) == ("all", 0, 1)


def test_answers_that_cannot_be_read_are_refused():
    hidden = truth(DAHL)
    with pytest.raises(SkidynError, match="not a case of this suite"):
        score_answers([hidden], [answer(name="case_099")])
    with pytest.raises(SkidynError, match="answered twice"):
        score_answers([hidden], [answer(), answer()])
    with pytest.raises(SkidynError, match="verdict 'fine'"):
        score_answers([hidden], [answer(verdict="fine")])
    with pytest.raises(SkidynError, match="joints from 1"):
        score_answers([hidden], [answer({"kind": "dahl", "joints": [0]})])


def test_wilson_interval_holds_its_share():
    low, high = wilson_interval(0, 20)
    assert low == 0 and high == pytest.approx(0.161, abs=0.001)
    assert wilson_interval(0, 0) == (0.0, 1.0)
