# SPDX-License-Identifier: BSD-3-Clause
"""Settings of servos are in the catalogue, and are no terms of a model."""

from dataclasses import fields

import pytest

from skidyn.effects import Term, get_effect, list_effects, make_terms
from skidyn.exceptions import EffectError
from skidyn.simulation import Controller

SETTINGS = [kind for kind in list_effects() if get_effect(kind).of_servo]


def test_the_catalogue_has_the_settings_of_servos():
    assert SETTINGS == ["servo_gain", "servo_current", "servo_voltage", "servo_deadband"]


@pytest.mark.parametrize("kind", SETTINGS)
def test_its_parameters_are_arguments_of_the_controller(kind):
    names = {c.name for c in get_effect(kind).coefficients}
    assert names <= {field.name for field in fields(Controller)}
    for spec in (kind, (kind, [1]), Term(kind, (1,))):
        with pytest.raises(EffectError, match=f"{kind} is a setting of the servo"):
            make_terms([spec], 2)


def test_units_of_sliders():
    assert get_effect("servo_gain").units(prismatic=True) == {"stiffness": "N/m"}
