# SPDX-License-Identifier: BSD-3-Clause
"""Which effects compete for a joint, and how they are told."""

from types import SimpleNamespace

import numpy as np
import pytest

from skidyn.effects import get_effect
from skidyn.simulation import LAWS
from skidyn.simulation._servo_laws import FRICTION, halves_told, rivals_of, sizes_told


def kinds(known=(), **words):
    return {kind for kind, _ in rivals_of(SimpleNamespace(**{"deadband": 0.0} | words), known)}


def test_what_the_controller_has_is_no_rival():
    assert kinds() == set(LAWS)
    assert set(LAWS) - kinds(deadband=0.01) == {"servo_deadband"}


def test_a_known_gear_is_the_only_one():
    assert set(LAWS) - kinds(("backlash", "stribeck")) == {
        "backlash",
        "joint_elasticity",
        "stribeck",
    }


@pytest.mark.parametrize("kind", LAWS)
def test_every_size_that_is_told_has_a_unit(kind):
    values = {name: r.start for name, r in (FRICTION | LAWS[kind]).items()}
    told = sizes_told(kind, values)
    assert set(told) <= {*get_effect(kind).units(), "power"}


def test_an_interval_follows_from_the_fitted_parameters():
    values = {"coulomb": 2.0, "presliding": 100.0, "compliance": 0.01}
    names, apart = ["coulomb", "presliding", "compliance"], np.diag([0.01, 4.0, 1e-8])
    half = halves_told("joint_elasticity", values, names, apart)["K"]
    assert half == pytest.approx(1.96 * 1e-4 / 0.01**2, rel=1e-3)
    half = halves_told("dahl", values, names, apart)["presliding"]
    assert half == pytest.approx(1.96 * 0.02 * np.hypot(0.1 / 2, 2 / 100), rel=1e-3)
