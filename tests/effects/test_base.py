# SPDX-License-Identifier: BSD-3-Clause
"""Units and parameters of effects."""

import numpy as np
import pytest

from skidyn.datasets import load_scara
from skidyn.effects import Signals, get_effect, list_effects


def test_units_of_sliders():
    assert get_effect("viscous").units(prismatic=True) == {"Fv": "N s/m"}
    assert get_effect("spring").units(prismatic=True) == {"k": "N/m", "q0": "m"}
    slides = np.array([kind == "prismatic" for kind in load_scara().joint_types])
    zero = np.zeros((3, 4))
    scara = Signals(zero, zero, zero, trajectory=np.zeros(3), prismatic=slides)
    dahl = get_effect("dahl")
    assert dahl.grid(scara, (2,))[0]["presliding"] == pytest.approx(
        dahl.grid(scara, (0,))[0]["presliding"] / 10
    )


def test_every_parameter_has_a_unit():
    for effect in map(get_effect, list_effects()):
        shape = {shape.name: 1.0 for shape in effect.shapes}
        found = effect.parameters(np.ones(len(effect.coefficients_of(shape))), shape)
        assert set(found) <= set(effect.units()), effect.kind
