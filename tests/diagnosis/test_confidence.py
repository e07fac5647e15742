# SPDX-License-Identifier: BSD-3-Clause
"""How sure a name is rises and falls with what speaks for it."""

import numpy as np
import pytest

from skidyn.diagnosis import confidence
from skidyn.diagnosis._confidence import mostly_stays, of_significant


def test_a_clear_name_is_sure_but_never_certain():
    assert 0.9 < confidence(1.0, 1.0, 1.0) <= 0.98


@pytest.mark.parametrize(
    "against",
    [
        {"nameless": True},
        {"whole_recordings": False},
        {"alike": True},
        {"few": True},
        {"stays": True},
        {"change": 0.1},
        {"instead": True},
        {"q_value": 1e-4},
    ],
)
def test_what_speaks_against_a_name_lowers_it(against):
    assert confidence(0.3, 1.0, 0.3, **against) < confidence(0.3, 1.0, 0.3)


def test_margin_white_remainder_and_size_raise_it():
    middle = confidence(0.3, 4.0, 0.05)
    assert confidence(0.6, 4.0, 0.05) > middle
    assert confidence(0.3, 2.0, 0.05) > middle
    assert confidence(0.3, 4.0, 0.2) > middle


def test_an_equal_explanation_lowers_it():
    assert confidence(0.0, 1.0, 0.3) > 0.94 > confidence(0.0, 1.0, 0.3, rivalled=True)
    assert confidence(0.1, 1.0, 0.3, rivalled=True) == confidence(0.1, 1.0, 0.3)
    # a tenth of a small effect is no evidence either
    weak = confidence(0.1, 1.0, 0.3, rivalled=True, lead=4.0)
    assert weak < 0.94 < confidence(0.1, 1.0, 0.3, rivalled=True, lead=40.0)


def test_a_name_that_the_data_hardly_separates_from_another_is_less_sure():
    assert (
        confidence(0.08, 1.0, 0.3) > 0.95 >= confidence(0.08, 1.0, 0.3, rivalled=True, lead=100.0)
    )


def test_that_something_has_no_name_is_less_sure():
    assert confidence(1.0, 1.0, 0.3, has_name=False) < 0.9 < confidence(1.0, 1.0, 0.3)


def test_a_name_that_leaves_most_of_the_error_is_not_sure():
    noise = np.array([0.1, 0.1])
    assert mostly_stays(np.array([0.2, 0.1]), np.array([0.19, 0.1]), noise)
    assert not mostly_stays(np.array([0.15, 0.1]), np.array([0.14, 0.1]), noise)  # coloured
    assert not mostly_stays(np.array([0.2, 0.1]), np.array([0.12, 0.1]), noise)
    assert not mostly_stays(np.array([0.105, 0.1]), np.array([0.104, 0.1]), noise)  # all is noise
    assert confidence(1.0, 1.0, 0.3, stays=True) < 0.9


def test_the_more_an_effect_changes_the_less_sure_is_its_name():
    sure = [confidence(0.3, 1.0, 0.3, change=change) for change in (0.02, 0.2, 0.8)]

    assert sure == sorted(sure, reverse=True)
    assert sure[0] > 0.8
    assert sure[-1] < 0.5


def test_whether_something_is_there_is_not_asked_again():
    weak = confidence(0.3, 1.0, 0.05, q_value=1e-5, calibrate=False)
    strong = confidence(0.3, 1.0, 0.05, calibrate=False)
    assert of_significant(weak, 1e-5) == pytest.approx(strong)
