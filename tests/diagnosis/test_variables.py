# SPDX-License-Identifier: BSD-3-Clause
"""The signals that a nameless torque depends on, by test."""


def test_the_signals_are_those_the_torque_depends_on(nameless):
    log, diagnosis = nameless.log, nameless.diagnosis

    assert diagnosis.verdict == "unknown"
    assert {j for f in diagnosis.findings for j in f.joints} == set(log.joints)
    for finding in diagnosis.findings:
        assert set(finding.variables) == nameless.variables
    for torque in diagnosis.unknowns:
        assert set(torque.variables) == nameless.variables
        for test in torque.tests:
            assert test.needed == (test.variable in torque.variables)
            assert test.p_value < 0.01 if test.needed else test.share < 0.05
