# SPDX-License-Identifier: BSD-3-Clause
"""Share of what is left that the signals still predict."""

from skidyn.diagnosis import Settings, diagnose


def test_a_spring_is_predictable_until_it_is_in_the_model(spring_log, missing):
    only = Settings(max_findings=0)
    given = diagnose(missing.base_model, spring_log.X, spring_log.y, settings=only, checks=())
    assert given.predictable[1] > 0.8
    assert missing.predictable[1] < 0.2
