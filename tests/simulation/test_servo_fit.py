# SPDX-License-Identifier: BSD-3-Clause
"""Models of a joint are fitted together as one by one."""

import numpy as np
import pytest

from skidyn.forward import read_task
from skidyn.identification import RBDRegressor
from skidyn.simulation import LAWS, servo_torque
from skidyn.simulation._servo_fit import fit_all
from skidyn.simulation._servo_laws import FRICTION
from skidyn.simulation._servo_motion import PIECE, _Arm


@pytest.fixture(scope="module")
def loop(sticky_servo):
    log, servo = sticky_servo.log, sticky_servo.controller
    model = RBDRegressor(sticky_servo.robot, ("viscous", "coulomb"))
    model.fit(log, servo_torque(servo, log))
    return _Arm(model, read_task(model, log, None, servo, PIECE), (), {1}).joints[0].loop


@pytest.mark.slow
def test_together_they_are_what_they_are_alone(loop):
    models = [FRICTION, {**FRICTION, **LAWS["stribeck"]}, {**FRICTION, **LAWS["backlash"]}]
    together = fit_all(loop, models, {})
    for model, fit in zip(models, together, strict=True):
        (alone,) = fit_all(loop, [model], {})
        np.testing.assert_allclose(list(alone.values.values()), list(fit.values.values()), 1e-6)
        np.testing.assert_allclose(alone.left_out, fit.left_out, rtol=1e-6)
    assert together[1].mean < 0.4 * together[0].mean


def test_one_half_alone_judges_the_other(loop):
    (both,), (one,) = fit_all(loop, [FRICTION], {}), fit_all(loop, [FRICTION], {}, (0,))
    assert np.isnan(one.left_out).sum() == (len(one.left_out) + 1) // 2
    odd = np.isfinite(one.left_out)
    np.testing.assert_allclose(one.left_out[odd], both.left_out[odd])
