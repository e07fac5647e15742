# SPDX-License-Identifier: BSD-3-Clause
"""The catalogue, and terms made from it."""

import pytest

from skidyn.effects import Term, get_effect, list_effects, make_terms
from skidyn.exceptions import EffectError


def test_catalogue_is_complete():
    assert len(list_effects()) == len(set(list_effects()))
    for kind in list_effects():
        effect = get_effect(kind)
        effect.check()
        assert effect.describe()["kind"] == kind and effect.reference
        assert set(effect.rivals) <= {*list_effects(), "unknown"}, kind
    with pytest.raises(EffectError, match="no effect 'dahll'"):
        get_effect("dahll")


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("dahll", "no effect"),
        (("dahl", [3]), "no joint 3"),
        (("dahl", [0]), "no joint 0"),
        (("coupled_friction", [1]), "couples two joints"),
    ],
)
def test_terms_that_cannot_be(spec, words):
    with pytest.raises(EffectError, match=words):
        make_terms([spec], 2)


def test_a_shape_that_is_given_in_part_gets_its_usual_values():
    (term,) = make_terms([Term("stribeck", (2,), {"vs": 0.1})], 2)
    assert term.shape == {"vs": 0.1, "delta": 2.0}
    whole, open_ = Term("stribeck", (2,), {"vs": 0.1, "delta": 1.0}), Term("stribeck", (2,))
    assert make_terms([whole, open_], 2) == [whole, open_]
