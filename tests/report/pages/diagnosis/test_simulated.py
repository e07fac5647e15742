# SPDX-License-Identifier: BSD-3-Clause
"""The simulated motion on the page, where a simulation was asked for."""

import json
import re
from importlib import resources
from types import SimpleNamespace

import numpy as np
import pytest

from skidyn.report import render_html, summarize
from skidyn.simulation import SimulationErrors, SimulationVerdict


@pytest.fixture
def judged(fakes):
    """A diagnosis with two findings; the second is not simulated."""
    diagnosis = fakes.make_diagnosis()

    def errors(position, velocity):
        position, velocity = np.array(position), np.array(velocity)
        pieces = np.tile(position, (6, 1))
        return SimulationErrors(
            diagnosis.joint_names, ("rad", "rad", "m"), 1.0, position, velocity, 2 * position,
            np.array([0.5, 0.6, 0.4]), pieces, np.arange(6.0),
        )  # fmt: skip

    before, after = (
        errors([0.0321, 0.0123, 0.0045], [0.11, 0.12, 0.013]),
        errors([0.0111, 0.0222, 0.0033], [0.051, 0.062, 0.0073]),
    )
    verdict = SimulationVerdict(before, after, -0.5, -0.9, -0.1, np.zeros(3))
    diagnosis.in_turn = SimpleNamespace(
        verdicts=[verdict, None], added=[True, False], together=verdict, silent=False
    )
    return diagnosis


def section(page):
    found = re.search(r'<section id="simulated">.*?</section>', page, re.S)
    return found and found.group()


def test_nothing_is_shown_where_no_simulation_was_asked_for(fakes):
    assert section(render_html(summarize(fakes.make_diagnosis()))) is None


def test_errors_of_every_joint_before_and_after(judged):
    shown = section(render_html(summarize(judged)))
    for text in ("0.032 → 0.011 rad", "0.11 → 0.051 rad/s", "0.0045 → 0.0033 m", "0.50 rad"):
        assert text in shown
    assert "cannot be simulated: spring on joint 3" in shown
    assert shown.count("after-bar") == 1 + 3  # the key and a bar of each joint
    assert "0.012 → 0.022 rad, worse" in shown


def test_a_model_alone_has_one_number_each_and_a_lost_motion_a_dash(judged):
    judged.in_turn.added[:] = [False, False]
    judged.in_turn.together.before.position[0] = np.inf
    shown = section(render_html(summarize(judged)))
    assert "→" not in shown and "after-bar" not in shown
    assert "<td>– rad</td>" in shown and "inf" not in shown.lower()


def test_the_report_has_the_same_numbers(judged):
    jsonschema = pytest.importorskip("jsonschema")
    report = summarize(judged)["report"]
    file = resources.files("skidyn.report").joinpath("diagnosis.schema.json")
    jsonschema.validate(report, json.loads(file.read_text()))
    assert report["simulation"]["before"]["velocity"] == [0.11, 0.12, 0.013]
    assert [e["simulation"]["says"] for e in report["effects"]] == ["improves", "nothing"]
