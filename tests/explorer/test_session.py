# SPDX-License-Identifier: BSD-3-Clause
"""The loop by hand without a browser."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn._exceptions import EffectError
from skidyn.diagnosis import Settings, diagnose


def test_the_missing_effect_is_ranked_first_and_its_addition_lowers_the_error(session):
    first = session.ranked(joint=2)[0]

    entry = session.add(first.kind, joint=2)

    assert (first.kind, first.joints) == ("spring", (2,))
    assert first.drop > 0.9
    assert entry["rmse"][1] < 0.2 * session.history[0]["rmse"][1]
    assert all(r.kind != "spring" or r.drop < 0.1 for r in session.ranked(joint=2))


def test_undo_takes_it_back(session):
    before = session.ranked(joint=2), session.curves(2, 0)
    session.add("spring", joint=2)

    session.undo()
    session.undo()  # nothing left to take back

    assert len(session.history) == 1
    assert (session.ranked(joint=2), session.curves(2, 0)) == before


def test_curves_keep_peaks_and_follow_what_was_added(session, log):
    measured = np.asarray(log.y)[log.X["trajectory"] == 3, 1]
    session.add("spring", joint=2)

    curves = session.curves(2, 3)

    assert max(curves["measured"]) == measured.max()
    given, now = (
        np.sqrt(np.mean(np.subtract(curves["measured"], curves[k]) ** 2)) for k in ("given", "now")
    )
    assert now < 0.7 * given  # reversals, which stay, are among the peaks


def test_a_stretch_of_time_ranks_by_what_happens_there(session):
    ranked = session.ranked(joint=2, trajectory=0, span=(2.0, 4.0))

    assert "spring" in [r.kind for r in ranked]
    assert any(r.drop_here != s.drop_here for r, s in zip(ranked, session.ranked(2), strict=False))


def test_the_saved_model_is_what_the_session_showed(session, log):
    session.add("spring", joint=2)

    model = session.fitted_model()

    only = Settings(max_findings=0)
    errors = diagnose(model, log.X, log.y, settings=only).rmse_before
    assert errors[1] < 0.3 * diagnose(session.model, log.X, log.y, settings=only).rmse_before[1]


def test_the_script_reproduces_the_clicks(session, log, tmp_path, monkeypatch, capsys):
    from importlib.resources import files

    urdf = files("skidyn.datasets").joinpath("robots", "planar_arm.urdf").read_text("utf-8")
    (tmp_path / "arm.urdf").write_text(urdf)
    log.frame.to_csv(tmp_path / "log.csv", index=False)
    session.add("spring", joint=2)
    monkeypatch.chdir(tmp_path)

    exec(compile(session.script(["log.csv"], "arm.urdf"), "explored.py", "exec"), {})

    given, better = (
        np.array(line.split("[")[1].rstrip("]").split(), dtype=float)
        for line in capsys.readouterr().out.splitlines()
    )
    assert better[1] < 0.3 * given[1]


def test_what_cannot_be_done_is_refused(session):
    with pytest.raises(EffectError, match="no joint 3; the robot has joints 1 to 2"):
        session.ranked(3)
    with pytest.raises(EffectError, match="no trajectory 99"):
        session.curves(1, 99)
    session.add("spring", joint=2)
    with pytest.raises(EffectError, match="spring cannot be added to joint 2"):
        session.add("spring", joint=2)
