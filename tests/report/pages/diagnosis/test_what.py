# SPDX-License-Identifier: BSD-3-Clause
"""A card for every finding."""

from skidyn.diagnosis import Proposal, UnknownTorque
from skidyn.report import render_html, summarize


def test_a_card_holds_rivals_the_motion_that_separates_and_the_code(diagnosis_page):
    shown = diagnosis_page["what"]
    assert "This data cannot separate it from LuGre friction or Stribeck friction" in shown
    assert "slow sweeps with small reversals, below 0.02 rad would separate them" in shown
    assert "diagnosis.add(&#34;dahl&#34;, joints=[1, 2])" in shown


def test_the_formula_of_an_unknown_torque_is_on_its_card(fakes):
    diagnosis = fakes.make_diagnosis("unknown")
    proposal = Proposal(2, "-39.4 abs(dq1)", ("abs(dq1)",), (-39.4,), 1.0, ())
    diagnosis.unknowns = [UnknownTorque(2, ("dq1",), (), {"variables": ("dq1",)}, proposal)]
    page = render_html(summarize(diagnosis))
    assert "An equivalent formula for joint 2: <code>-39.4 abs(dq1)</code>" in page
