# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn completion``."""

import shutil
import subprocess
from contextlib import redirect_stdout

import pytest

from skidyn import cli


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_completion_knows_the_commands(shell, capsys, run):
    pytest.importorskip("shtab")
    assert cli.main(["completion", shell]) == cli.DONE
    script = capsys.readouterr().out
    assert "diagnose" in script and "--drive-gains" in script
    code, told = run("completion", shell)
    assert code == cli.DONE and told["script"] == script.removesuffix("\n")


def test_every_option_with_choices_is_completed(tmp_path):
    """A real bash is asked for what may follow."""
    pytest.importorskip("shtab")
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("bash is not installed")
    script = tmp_path / "skidyn.bash"
    with script.open("w") as file, redirect_stdout(file):
        assert cli.main(["completion", "bash"]) == cli.DONE
    wanted = {
        "check --clock": {"auto", "recorded", "regular"},
        "diagnose --torque-sign": {"recorded", "command"},
        "export --format": {"c", "python", "onnx", "urdf", "mjcf", "usd", "bam", "ros2"},
        "simulate --robot": {"panda", "scara", "ur5"},
        "simulate --engine": {"own", "mujoco"},
        "add --effect": {"dahl", "spring"},
        "excite --criterion": {"determinant", "condition"},
        "identify --estimator": {"robust", "ridge"},
        "completion": {"bash", "zsh", "tcsh"},
    }
    for words, expected in wanted.items():
        line = ["skidyn", *words.split(), ""]
        typed = " ".join(f"'{word}'" for word in line)
        ask = (
            f"source {script}; COMP_WORDS=({typed}); COMP_CWORD={len(line) - 1}; "
            '_shtab_skidyn; printf "%s\\n" "${COMPREPLY[@]}"'
        )
        answer = subprocess.run([bash, "-c", ask], capture_output=True, text=True, check=True)
        assert expected <= set(answer.stdout.split()), words
