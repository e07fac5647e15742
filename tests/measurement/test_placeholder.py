# SPDX-License-Identifier: BSD-3-Clause
"""Remedies name columns, quantities or all signals, and values with all their digits."""

import pytest

from skidyn.measurement import Remedy
from skidyn.measurement._placeholder import in_words, placeholder_remedy

ALL = [(quantity, k) for quantity in ("q", "dq", "tau") for k in range(2)]


@pytest.mark.parametrize(
    "channels, option",
    [(ALL, "all=9999"), (ALL[:2], "q=9999"), ([*ALL[:2], ALL[3]], "q=9999,dq2=9999")],
)
def test_the_option_is_as_short_as_possible(channels, option):
    remedy = Remedy(*placeholder_remedy(9999.0, channels, 2))
    assert remedy.option == f"--placeholder {option}"
    names = {word.partition("=")[0]: 9999.0 for word in option.split(",")}
    assert remedy.arguments == {"placeholder": names}


def test_channels_in_words():
    assert in_words(ALL[:4], 2) == "positions and velocities of all joints"
    assert in_words([("tau", 0), ("q", 1)], 2) == "positions of joint 2 and torques of joint 1"
