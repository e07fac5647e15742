# SPDX-License-Identifier: BSD-3-Clause
"""One list of checks: what it suspects, how sure, and the option that fixes it."""

import pytest

from skidyn.diagnosis import Settings, diagnose
from skidyn.exceptions import LogError
from skidyn.identification import RBDRegressor
from skidyn.measurement import Remedy, Suspicion, list_checks, refuse_certain


def test_nothing_wrong(signals, torque, found):
    assert found(signals, torque) == []
    assert found(signals, torque, None) == []


def test_certain_ones_come_first_and_stop_a_diagnosis(arm, recorded):
    turned = recorded.X.assign(dq2=-recorded.X["dq2"])
    model = RBDRegressor(arm)
    with pytest.raises(LogError, match="--flip dq2.*force=True"):
        diagnose(model, turned, recorded.y)
    with pytest.warns(UserWarning, match="has the opposite sign"):
        forced = diagnose(model, turned, recorded.y, settings=Settings(max_findings=0), force=True)
    assert forced.checks[0].certainty == "certain"
    assert forced.to_dict()["checks"][0]["remedy"] == {
        "option": "--flip dq2",
        "code": "flip=['dq2']",
    }


def test_refusal_names_every_remedy():
    two = [
        Suspicion("a", "this", "seen", "certain", remedy=Remedy("--flip x", "flip=['x']")),
        Suspicion("b", "that", "seen", "suspected", remedy=Remedy("--unwrap", "unwrap=True")),
    ]
    with pytest.raises(LogError, match="--flip x") as caught:
        refuse_certain(two)
    assert "--unwrap" not in str(caught.value)


def test_checks_have_names_of_their_own():
    checks = list_checks()
    assert len({check.name for check in checks}) == len(checks)
    assert all(check.suspects for check in checks)
