# SPDX-License-Identifier: BSD-3-Clause
"""Numbers, joints and names as a user reads them."""

import pytest

from skidyn._text import digits, give_or_take, inside, joints_told, listed, measure, suggest


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.6346, "0.63"), (12.34, "12"), (0.0, "0"), (3e-7, "3e-07"), (float("nan"), "–")],
)
def test_two_digits_and_no_exponent_at_usual_sizes(value, text):
    assert digits(value) == text


def test_a_value_has_the_digits_that_its_interval_leaves():
    assert give_or_take(971.2, 316.0) == "971 ± 316"
    assert give_or_take(1.0, float("nan")) == "1.0"
    assert measure("k", (3.5, 3.1, 3.9), "N m/rad^2") == "k = 3.50 ± 0.40 N m/rad²"
    assert measure("n", 3) == "n = 3"


def test_words_of_a_sentence():
    assert joints_told([1]) == "joint 1" and joints_told([1, 2, 4]) == "joints 1, 2 and 4"
    assert listed(["a", "b"], "or") == "a or b" and listed([]) == ""
    assert inside("Coulomb friction") == "Coulomb friction" and inside("Spring") == "spring"


def test_a_name_is_suggested_only_where_one_is_near():
    assert suggest("dq_elbw", ["q_elbow", "dq_elbow"]) == " (did you mean 'dq_elbow'?)"
    assert suggest("weight", ["q1", "q2"]) == ""
