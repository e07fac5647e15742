# SPDX-License-Identifier: BSD-3-Clause
"""What is suspected, and how to mend it, in words."""

import pytest

from skidyn.measurement import Remedy, Suspicion
from skidyn.measurement._suspicion import exactly, remedy_of

MENDED = Remedy("--flip elbow", "flip=['elbow']")


def test_the_sentence_ends_with_the_remedy():
    told = str(Suspicion("reading", "the sign differs", "seen", "certain", (2,), MENDED))
    mend = "Fix it with --flip elbow (in Python: flip=['elbow'])."
    assert told == f"the sign differs: seen. {mend}"


def test_reports_hold_all_of_it():
    assert Suspicion("gaps", "time has gaps", "seen", "noted").to_dict()["remedy"] is None
    told = Suspicion("reading", "a", "b", "certain", (2,), MENDED).to_dict()
    assert told["joints"] == [2] and told["remedy"]["option"] == "--flip elbow"


def test_remedies_are_arguments_of_read_log():
    assert Remedy("--gain tau2=5", "gain={'tau2': 5.0}").arguments == {"gain": {"tau2": 5.0}}
    assert Remedy("--controller fit", "Controller(delay=...), fit_servo").arguments == {}


def test_no_digit_of_a_value_is_lost():
    value = 9999 * 3.141592653589793 / 180
    assert float(exactly(value)) == value and exactly(1e6) == "1e+06" and exactly(-1.0) == "-1"


@pytest.mark.parametrize(
    "argument, value, option",
    [
        ("gain", {"q": 0.123456789}, "--gain q=0.123456789"),
        ("order", {"dq": [2, 1], "tau": [2, 1]}, "--order dq=2,1,tau=2,1"),
        ("derive", ["dq1", "dq2"], "--derive dq1,dq2"),
        ("torque_sign", "command", "--torque-sign command"),
        ("split_leaps", True, "--split-leaps"),
    ],
)
def test_a_remedy_is_an_option_and_an_argument(argument, value, option):
    remedy = Remedy(*remedy_of(argument, value))
    assert remedy.option == option
    assert remedy.arguments == {argument: value}
