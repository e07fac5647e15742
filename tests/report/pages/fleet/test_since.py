# SPDX-License-Identifier: BSD-3-Clause
"""Since when a robot has changed."""

from skidyn.report import render_html, summarize_fleet


def test_the_date_of_the_alarm(fleet_page):
    assert "robot 3: coulomb.Fc[2] left its band on 4 May" in fleet_page["since"]


def test_nothing_is_shown_where_no_robot_was_watched(fakes):
    assert "since" not in summarize_fleet(fakes.make_fleet())["since"]
    assert 'id="since"' not in render_html(summarize_fleet(fakes.make_fleet()))
