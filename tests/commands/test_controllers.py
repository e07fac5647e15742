# SPDX-License-Identifier: BSD-3-Clause
"""Controllers on the command line; settings of servos in a report are tested in test_add.py."""

import pytest

from skidyn import cli


@pytest.mark.parametrize("text", ['{"stiffness": 4', '{"damping": 2}', '{"stiffness": 4, "ki": 1}'])
def test_a_wrong_controller_is_refused(work, text, capsys):
    words = ["diagnose", str(work / "log.csv"), "--urdf", str(work / "arm.urdf")]
    assert cli.main([*words, "--controller", text]) == cli.BAD_INPUT
    assert "--controller is" in capsys.readouterr().err
