# SPDX-License-Identifier: BSD-3-Clause
"""What the motion of servos names on the page, where a controller was given."""

import re

from skidyn.report import render_html, summarize
from skidyn.simulation import ServoFinding


def section(page):
    found = re.search(r'<section id="servos">.*?</section>', page, re.S)
    return found and found.group()


def test_nothing_is_shown_where_no_controller_was_given(fakes):
    assert section(render_html(summarize(fakes.make_diagnosis()))) is None


def test_each_effect_has_its_size_and_a_bar_for_each_model(fakes):
    diagnosis = fakes.make_diagnosis()
    diagnosis.servo_motion = [
        ServoFinding("backlash", 3, {"gap": 0.004}, 0.002, 0.0005, "dahl", 0.0012, "m")
    ]
    page = render_html(summarize(diagnosis))
    shown = section(page)
    assert "Backlash" in shown and "gap = 0.0040 m" in shown
    for text in ("2.0 mm", "0.50 mm", "1.2 mm", "width:25.0%"):
        assert text in shown
    assert '<a href="#servos">Backlash</a> on joint 3' in page


def test_a_motion_that_names_nothing_says_so(fakes):
    diagnosis = fakes.make_diagnosis("complete")
    diagnosis.servo_motion = []
    assert "It requires no effect other than friction." in section(
        render_html(summarize(diagnosis))
    )
