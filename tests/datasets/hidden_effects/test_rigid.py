# SPDX-License-Identifier: BSD-3-Clause
"""Simulated payloads and forces."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log
from skidyn.exceptions import SkidynError

PLANAR, SCARA = load_planar_arm(), load_scara()
SHORT = {"n_trajectories": 4, "duration": 4.0}


def difference(robot, effect, **options):
    """Torque of an effect: a noiseless log with it less one without."""
    with_effect = make_hidden_effect_log(robot, effect, noise=0.0, **SHORT, **options)
    base = with_effect.base
    without = make_hidden_effect_log(robot, None, noise=0.0, base=base, **SHORT)
    return with_effect, with_effect.y - without.y


def test_payload_and_wrench_act_in_their_trajectories_only():
    for kind in ("payload", "external_wrench"):
        log, torque = difference(PLANAR, kind)
        loaded = np.isin(log.frame["trajectory"], log.parameters["trajectories"])
        assert np.abs(torque[loaded]).max() > 0 and np.abs(torque[~loaded]).max() == 0
    with pytest.raises(SkidynError, match="some trajectories only"):
        make_hidden_effect_log(PLANAR, "payload", n_trajectories=1, duration=2.0)
