# SPDX-License-Identifier: BSD-3-Clause
"""The log of the demonstration."""

from skidyn.datasets import load_demo_log


def test_demo_log_is_always_the_same():
    first, second = load_demo_log(), load_demo_log()
    assert first.frame.equals(second.frame)
    assert [effect["joints"] for effect in first.truth] == [(4,), (2,)]
