# SPDX-License-Identifier: BSD-3-Clause
"""A user's own effect."""

import numpy as np
import pytest

from skidyn.effects import (
    Coefficient,
    Effect,
    get_effect,
    register_effect,
    unregister_effect,
)
from skidyn.exceptions import EffectError


@pytest.mark.slow
def test_diagnosis_finds_a_users_effect(robot):
    from skidyn.datasets import make_hidden_effect_log
    from skidyn.diagnosis import diagnose
    from skidyn.identification import RBDRegressor

    class Magnet(Effect):
        kind = "magnet"
        title = "Magnet"
        formula = r"a\,e^{-(q/0.2)^2}"
        coefficients = (Coefficient("a", "N m"),)
        drawn_against = "q"

        def columns(self, signals, joint, **shape):
            return np.exp(-((signals.q[:, joint] / 0.2) ** 2))[:, None]

    log = make_hidden_effect_log(robot, None, n_trajectories=6, duration=6.0)
    y = np.array(log.y, dtype=float)
    y[:, 1] += 2.0 * np.exp(-((np.asarray(log.X["q2"]) / 0.2) ** 2))
    register_effect(Magnet)
    try:
        effects = ["magnet", "spring", "dahl"]
        found = diagnose(RBDRegressor(log.robot), log.X, y, effects=effects).findings
        assert [f.kind for f in found] == ["magnet"]
        assert found[0].terms[0].joints == (2,)
    finally:
        unregister_effect("magnet")


def test_the_closest_names_are_suggested_for_an_unknown_one():
    with pytest.raises(EffectError, match="did you mean 'dahl'.*skidyn effects lists") as caught:
        get_effect("dhal")
    assert len(str(caught.value)) < 150
