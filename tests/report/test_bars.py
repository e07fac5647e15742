# SPDX-License-Identifier: BSD-3-Clause
"""The scale of the bars on the first screen: multiples of the noise."""

import re

import numpy as np
import pytest

from skidyn.report import render_html, summarize


@pytest.fixture
def drawn(fakes):
    """Ticks with their places, and lengths of the bars, where the largest error is a multiple."""

    def draw(largest):
        diagnosis = fakes.make_diagnosis()
        diagnosis.noise_floor = np.full(3, max(diagnosis.history[0]["rmse"]) / largest)
        page = render_html(summarize(diagnosis))
        (ticks,) = re.findall(r'class="ticks">(.*?)</td>', page)
        places = {told: float(left) for left, told in re.findall(r"left:([\d.]+)%\">(.*?)<", ticks)}
        lengths = re.findall(r'class="before-bar" style="width:([\d.]+)%', page)
        return places, [float(length) for length in lengths]

    return draw


def test_a_usual_error_is_drawn_to_scale(drawn):
    ticks, lengths = drawn(4.0)
    assert list(ticks) == ["noise", "2 ×", "3 ×", "4 ×"]
    assert ticks["4 ×"] == pytest.approx(4 * ticks["noise"])
    assert max(lengths) == pytest.approx(ticks["4 ×"], abs=0.2) and max(lengths) < 100


def test_a_huge_error_leaves_the_noise_in_sight(drawn):
    ticks, lengths = drawn(300.0)
    assert list(ticks) == ["noise", "10 ×", "100 ×"]
    assert ticks["noise"] > 5
    assert ticks["100 ×"] - ticks["10 ×"] == pytest.approx(ticks["10 ×"] - ticks["noise"], abs=0.2)
    assert ticks["100 ×"] < max(lengths) < 100


def test_ticks_are_never_crowded(drawn):
    for largest in (1.0, 1.6, 2.5, 7.0, 11.0, 12.5, 5e4):
        places = sorted(drawn(largest)[0].values())
        assert places and np.all(np.diff(places) > 14)
