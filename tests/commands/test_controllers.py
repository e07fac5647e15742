# SPDX-License-Identifier: BSD-3-Clause
"""Controllers as they are given on the command line, and settings of servos in a report."""

import json

import numpy as np
import pytest

from skidyn._commands._controllers import controller_told, read_controller, settings_of
from skidyn.datasets import load_planar_arm
from skidyn.exceptions import SkidynError
from skidyn.simulation import Controller

ARM = load_planar_arm()


def test_a_controller_that_is_told_is_read_again():
    given = Controller((40.0, 20.0), limit=(np.inf, 1.5), delay=0.01, follows_velocity=False)
    told = controller_told(given, 2)
    assert json.loads(told)["limit"] == [None, 1.5] and "damping" not in told
    again = read_controller(told, ARM, None, None)
    for name in ("stiffness", "damping", "limit", "no_load_speed"):
        assert np.array_equal(getattr(again, name), getattr(given.checked(2), name))
    assert (again.delay, again.follows_velocity) == (0.01, False)


@pytest.mark.parametrize("text", ['{"stiffness": 4', '{"damping": 2}', '{"stiffness": 4, "ki": 1}'])
def test_a_wrong_controller_is_refused(text):
    with pytest.raises(SkidynError, match="--controller is"):
        read_controller(text, ARM, None, None)


def test_settings_of_a_report_are_read_and_wrong_ones_refused(tmp_path):
    path = tmp_path / "report.json"
    limit = {"kind": "servo_current", "joints": [2], "parameters": {"limit": {"value": 0.5}}}
    path.write_text(json.dumps({"effects": [{"kind": "stribeck", "joints": [1]}, limit]}))
    (found,) = settings_of(str(path))
    assert (found.kind, found.joint, found.values) == ("servo_current", 2, {"limit": 0.5})
    assert found.is_of("servo_current", None) and not found.is_of("servo_current", [1])
    path.write_text(json.dumps({"effects": [{**limit, "parameters": {}}]}))
    with pytest.raises(SkidynError, match="it must come from skidyn diagnose"):
        settings_of(str(path))
