# SPDX-License-Identifier: BSD-3-Clause
"""What is suspected, and how to mend it, in words."""

from skidyn.measurement import Remedy, Suspicion

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
