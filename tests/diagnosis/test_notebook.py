# SPDX-License-Identifier: BSD-3-Clause
"""The first screen in a notebook."""

import dataclasses

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor


@pytest.fixture(scope="module")
def missing():
    log = make_hidden_effect_log(load_planar_arm(), "spring", joints=[2])
    return diagnose(RBDRegressor(log.robot), log.X, log.y)


def test_a_notebook_shows_it_escaped(missing):
    hostile = dataclasses.replace(missing, joint_names=("<script>", "elbow"))
    html = hostile._repr_html_()
    assert "Missing: spring" in html and "<script>" not in html
    assert "nan" not in html.lower()


def test_a_finding_shows_itself_in_a_notebook(missing):
    finding = dataclasses.replace(missing.findings[0], title="<b>Spring")
    html = finding._repr_html_()
    assert "&lt;b&gt;Spring" in html and "on joint 2" in html
    assert "k = " in html and "diagnosis.add(" in html
