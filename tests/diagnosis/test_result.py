# SPDX-License-Identifier: BSD-3-Clause
"""What a user does with a diagnosis."""

import json

import numpy as np
import pytest

from skidyn.exceptions import EffectError


def test_causes_make_up_the_squared_error(missing):
    shares = missing.budget[1]
    assert set(shares) == {"spring", "unexplained", "noise"}
    assert sum(shares.values()) == pytest.approx(1.0, abs=0.05)
    assert shares["spring"] > 0.9


def test_the_better_model_and_one_by_hand_are_the_same(missing, spring_log):
    by_hand = missing.add("spring", joints=2)
    np.testing.assert_allclose(
        by_hand.predict(spring_log.X), missing.model.predict(spring_log.X), atol=1e-9
    )


def test_what_cannot_be_added_is_refused(missing):
    with pytest.raises(ValueError, match=r"joints='second'; expected the number"):
        missing.add("spring", joints="second")
    with pytest.raises(EffectError, match="no joint 7"):
        missing.add("spring", joints=[7])
    with pytest.raises(EffectError, match="no formula was proposed"):
        missing.add("formula")
    with pytest.raises(EffectError, match="has viscous on these joints already: joints 1 and 2"):
        missing.add("viscous")
    with pytest.raises(EffectError, match="temperature_friction needs joint temperatures"):
        missing.add("temperature_friction")


def test_the_report_is_json_and_the_text_holds_every_finding(missing):
    report = json.loads(json.dumps(missing.to_dict()))
    assert report["verdict"] == "missing"
    assert [e["kind"] for e in report["effects"]] == ["spring"]
    assert missing.findings[0].sentence in repr(missing)
