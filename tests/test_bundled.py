# SPDX-License-Identifier: BSD-3-Clause
"""Pages hold the plotting library, with its licence, and load nothing."""

import re

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

pytest.importorskip("jinja2", reason="needs skidyn[report]")


def test_a_report_holds_the_library_and_its_licence_and_loads_nothing():
    from skidyn.report import render_html, summarize

    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=3.0)
    page = render_html(summarize(diagnose(RBDRegressor(log.robot), log.X, log.y, effects=[])))
    assert "uPlot" in page and "The MIT License (MIT)" in page
    assert ".u-over" in page  # its style
    loaded = re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=[\"']?([^\"' >]+)", page)
    assert all(address.startswith("data:") for address in loaded)
