# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn check``."""

from skidyn import cli


def test_check_judges_a_log_without_and_with_a_robot(capsys, run, arguments):
    log, urdf = arguments[0], arguments[-1]
    assert cli.main(["check", log]) == cli.DONE
    assert "at limit" in capsys.readouterr().out
    code, quality = run("check", log, "--urdf", urdf)
    assert code == cli.DONE
    assert quality["gaps"] == 0 and quality["joints"][0]["name"] == "joint1"
