# SPDX-License-Identifier: BSD-3-Clause
"""What a log could still hide."""


def test_every_limit_has_its_size_and_words(diagnosis_page):
    shown = diagnosis_page["limits"]
    assert "2 effects on single joints were tested and not found" in shown
    assert "torque ripple 1 0.12 N m torque ripple on joint 1: below 0.12 N m" in shown
    assert "end stop 2 – N m" in shown
