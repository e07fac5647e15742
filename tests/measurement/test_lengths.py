# SPDX-License-Identifier: BSD-3-Clause
"""Lengths of links that are not those of the description."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.logs import check_log

ARM = load_planar_arm()
LOG = make_hidden_effect_log(ARM, None, n_trajectories=5, duration=6.0, random_state=2).frame


def described(robot, factors):
    """A description whose bodies are so many times as far from those that carry them."""
    translations = robot.tree.translations * np.asarray(factors)[:, None]
    return replace(robot, tree=replace(robot.tree, translations=translations))


def told(frame, robot):
    return [s for s in check_log(frame, robot).checks if s.certainty != "noted"]


def test_lengths_of_the_description_are_right():
    assert told(LOG, ARM) == []


@pytest.mark.parametrize("factor", [0.75, 1.3])
def test_a_link_of_another_length(factor):
    (one,) = told(LOG, described(ARM, [1.0, factor]))
    assert (one.check, one.certainty, one.joints) == ("lengths", "suspected", (2,))
    share = 100 * (1 / factor - 1)
    found = float(one.evidence.split("from joint1 to joint2 by ")[1].split(" %")[0])
    assert found == pytest.approx(share, abs=8)
    assert one.remedy is None


def test_a_base_of_another_height_changes_no_torque():
    assert told(LOG, described(ARM, [1.5, 1.0])) == []


def test_a_payload_makes_no_link_longer():
    frame = make_hidden_effect_log(
        ARM, "payload", n_trajectories=5, duration=6.0, random_state=5
    ).frame
    assert "lengths" not in {s.check for s in told(frame, ARM)}


@pytest.mark.slow
def test_links_of_an_arm():
    robot = load_ur5()
    frame = make_hidden_effect_log(
        robot, "stribeck", joints=[2], n_trajectories=4, duration=6.0, random_state=6
    ).frame
    (one,) = told(frame, described(robot, [1, 1, 0.8, 1.2, 1, 1]))
    assert one.check == "lengths" and {3, 4} <= set(one.joints)


@pytest.mark.parametrize("change", [lambda x: 1.2 * x, lambda x: np.round(2 * x / x.std()) / 2])
def test_gains_and_coarse_torque_make_no_link_longer(change):
    frame = LOG.assign(tau2=change(LOG["tau2"]))
    assert "lengths" not in {s.check for s in told(frame, ARM)}


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda q, dq: (q + 0.4, dq), "the zero of joint 2 is off by about 23 deg"),
        (lambda q, dq: (0.6 * q, 0.6 * dq), "positions and velocities of joint 2"),
    ],
)
def test_a_zero_or_scale_of_positions_is_no_length(change, text):
    frame = LOG.copy()
    frame["q2"], frame["dq2"] = change(frame["q2"], frame["dq2"])
    found = told(frame, ARM)
    assert "lengths of links" not in " ".join(s.suspicion for s in found)
