# SPDX-License-Identifier: BSD-3-Clause
"""How sure an added name is said to be."""

from types import SimpleNamespace

from skidyn.explorer._sure import Margin, margin, sure_told


def ranked(**drops):
    return [SimpleNamespace(kind=k, title=k.title(), drop=drop) for k, drop in drops.items()]


def test_the_best_effect_is_sure_where_no_other_comes_near():
    over = margin("spring", ranked(spring=0.9, offset=0.1))
    assert 0.9 < over.share < 1 and sure_told(over, 1.0, 0.9, True) == "confidence 98%"
    assert margin("spring", ranked(spring=0.9)) == Margin()


def test_a_rival_that_takes_nearly_as_much_is_named():
    told = sure_told(margin("spring", ranked(spring=0.9, offset=0.89)), 1.0, 0.9, True)
    assert told.endswith("offset removes nearly as much of the error")


def test_an_error_that_is_left_makes_a_name_less_sure():
    white, slow = (sure_told(Margin(0.5, "Offset"), i, 0.9, True) for i in (1.0, 12.0))
    assert white > "confidence 95%" and slow < "confidence 80%"


def test_an_effect_that_another_beats_is_not_sure():
    told = sure_told(margin("offset", ranked(spring=0.9, offset=0.2)), 1.0, 0.9, True)
    assert told == "low confidence: spring removes more of the error"
