# SPDX-License-Identifier: BSD-3-Clause
"""The loop by hand without a browser."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.diagnosis import Settings, diagnose
from skidyn.effects import get_effect
from skidyn.exceptions import EffectError
from skidyn.explorer import Session
from skidyn.identification import RBDRegressor


def test_the_missing_effect_is_ranked_first_and_its_addition_lowers_the_error(session):
    first = session.ranked(joint=2)[0]

    entry = session.add(first.kind, joint=2)

    assert (first.kind, first.joints) == ("spring", (2,))
    assert first.drop > 0.9
    assert entry["rmse"][1] < 0.2 * session.history[0]["rmse"][1]
    assert all(r.kind != "spring" or r.drop < 0.1 for r in session.ranked(joint=2))


def test_undo_takes_it_back(session):
    before = session.ranked(joint=2), session.curves(2, 1)
    session.add("spring", joint=2)

    session.undo()
    session.undo()  # nothing left to take back

    assert len(session.history) == 1
    assert (session.ranked(joint=2), session.curves(2, 1)) == before


def test_ranks_are_by_the_measured_drop_of_the_joint_asked_about(session):
    for joint in (1, 2):
        drops = [round(r.drop, 3) for r in session.ranked(joint)]  # of equal ones, the simpler
        assert drops == sorted(drops, reverse=True)
    # the spring of joint 2 says nothing about joint 1
    assert all(r.kind != "spring" or 1 in r.joints for r in session.ranked(joint=1))


def test_the_drop_shown_is_the_drop_that_comes(session):
    for ranked in session.ranked(joint=2)[:3]:
        before = session.history[-1]["rmse"][1]
        after = session.add(ranked.kind, joint=2, refined=False)["rmse"][1]
        session.undo()
        # the ranking judges averaged rows, which hold less noise than the samples
        assert 1 - (after / before) ** 2 == pytest.approx(ranked.drop, abs=0.1)


def test_refinement_comes_after_the_first_answer(session):
    kind = next(e for e in session.ranked(2) if get_effect(e.kind).shapes).kind
    session.add(kind, joint=2, refined=False)
    assert session.refinable
    session.refine()
    late = session.added, session.history[-1]
    session.undo()

    session.add(kind, joint=2)

    assert (session.added, session.history[-1]) == late
    assert not session.refinable
    session.refine()  # nothing left to refine
    assert len(session.history) == 2


def test_a_stretch_of_time_ranks_by_what_happens_there(session):
    start, end = session.stretch(joint=2, trajectory=1, time=3.0)
    ranked = session.ranked(joint=2, trajectory=1, span=(start, end))

    assert start <= 2.5 and end >= 3.5
    assert "spring" in [r.kind for r in ranked]
    here = [round(r.drop_here, 3) for r in ranked]
    assert here == sorted(here, reverse=True)
    assert any(r.drop != r.drop_here for r in ranked)


def test_the_saved_model_is_what_the_session_showed(session, log):
    session.add("spring", joint=2)

    model = session.fitted_model()

    only = Settings(max_findings=0)
    errors, given = (
        diagnose(m, log.X, log.y, settings=only, checks=()).rmse_before
        for m in (model, session.model)
    )
    assert errors[1] < 0.3 * given[1]


def test_what_cannot_be_done_is_refused(session):
    with pytest.raises(EffectError, match="no joint 3; the robot has joints 1 to 2"):
        session.ranked(3)
    for ask in (session.curves, session.residuals):
        with pytest.raises(EffectError, match="no trajectory 99"):
            ask(1, 99)
    with pytest.raises(EffectError, match="joint 1 does not move in trajectory 99"):
        session.stretch(1, 99, 1.0)
    session.add("spring", joint=2)
    with pytest.raises(EffectError, match="spring cannot be added to joint 2"):
        session.add("spring", joint=2)


def test_an_addition_is_removed_whatever_came_after_it(session):
    session.add("spring", joint=2)
    alone = session.history[-1]["rmse"]
    session.undo()
    session.add("offset", joint=1)
    session.add("spring", joint=2)

    entry = session.remove(1)

    assert [h["added"] for h in session.history] == [None, "spring"]
    assert entry["rmse"] == pytest.approx(alone, rel=1e-6)
    with pytest.raises(EffectError, match="no addition 2"):
        session.remove(2)


def test_nothing_is_offered_where_nothing_helps(session):
    session.add("spring", joint=2)
    assert session.ranked(joint=1) == []


def test_of_payloads_of_several_links_the_largest_is_ranked_and_added():
    log = make_hidden_effect_log(load_ur5(), None, n_trajectories=5, duration=4.0, random_state=1)
    heavier = log.robot.inertial_parameters.copy()
    heavier[2, :4] += 3.0 * np.array([1.0, 0.1, 0.0, 0.05])
    motion = [log.X[[f"{name}{j + 1}" for j in range(6)]] for name in ("q", "dq", "ddq")]
    change = log.robot.inverse_dynamics(*motion, parameters=heavier)
    change -= log.robot.inverse_dynamics(*motion)
    own = log.X["trajectory"].isin([1, 3]).to_numpy()
    session = Session(RBDRegressor(log.robot), log.X, log.y + change * own[:, None])

    (shown,) = [effect for effect in session.ranked(2) if effect.kind == "payload"]
    session.add("payload", 2)

    assert shown.trajectories == (1, 3)
    assert shown.drop > 0.9
    assert [term.form for term in session.terms if term.kind == "payload"] == [{"link": 2}]
