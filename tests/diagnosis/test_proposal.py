# SPDX-License-Identifier: BSD-3-Clause
"""A formula for a nameless torque that can be adopted."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.exceptions import EffectError
from skidyn.identification import RBDRegressor


def test_a_formula_is_proposed_and_adopted_with_one_call(nameless):
    log, diagnosis = nameless.log, nameless.diagnosis

    proposal = diagnosis.unknowns[0].proposal
    assert proposal.expressions == (nameless.formula,)
    assert proposal.coefficients[0] == pytest.approx(nameless.size, rel=0.03)
    assert proposal.text in diagnosis.findings[0].sentence

    model = diagnosis.add("formula")

    residual = np.asarray(log.y) - model.predict(log.X)
    sliding = diagnosis.comparison.sliding
    error = np.sqrt(np.where(sliding, residual**2, 0).sum(0) / sliding.sum(0))
    assert np.all(error < 1.1 * diagnosis.rmse_after)


@pytest.mark.slow
def test_a_torque_periodic_in_time_gets_its_wave_as_formula():
    log = make_hidden_effect_log(
        load_planar_arm(), "unknown_clock", n_trajectories=6, duration=6.0, random_state=5
    )

    diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y, checks=())

    (torque,) = diagnosis.unknowns
    assert torque.variables == ("time",)
    assert all("* t)" in e for e in torque.proposal.expressions)
    assert f"{2 * np.pi * log.parameters['frequency']:.2g}" in torque.proposal.text


def test_where_nothing_is_unknown_there_is_no_formula_to_add(complete):
    with pytest.raises(EffectError, match="no formula"):
        complete.add("formula")
