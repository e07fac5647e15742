# SPDX-License-Identifier: BSD-3-Clause
"""Which effects compete for a joint, and how they are told."""

from types import SimpleNamespace

import pytest

from skidyn.simulation import LAWS, SERVO_EFFECTS, title_of
from skidyn.simulation._servo_laws import FRICTION, rivals_of, sizes_told, units_told


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
    assert title_of(kind) and set(told) <= {*units_told(kind, False), "power"}
    assert kind not in SERVO_EFFECTS or set(told) == set(units_told(kind, True))
