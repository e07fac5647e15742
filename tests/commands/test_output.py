# SPDX-License-Identifier: BSD-3-Clause
"""Outputs that are closed, full or narrow."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from skidyn import cli


def shell(words, **options):
    """Run the command line in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "skidyn", *words], text=True, check=False, **options
    )


@pytest.mark.skipif(os.name != "posix", reason="another shell")
def test_closed_and_narrow_outputs_are_no_traceback(work):
    words = ["identify", str(work / "log.csv"), "--urdf", str(work / "arm.urdf")]
    ascii_only = os.environ | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    done = shell(words, env=ascii_only, capture_output=True)
    assert done.returncode == cli.DONE and " +- " in done.stdout
    closed = subprocess.run(
        ["sh", "-c", 'exec "$0" -m skidyn effects >&-', sys.executable],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert (closed.returncode, closed.stderr) == (cli.DONE, "")
    if os.path.exists("/dev/full"):
        with open("/dev/full", "w") as full:
            done = shell(["effects", "--json"], stdout=full, stderr=subprocess.PIPE)
        assert done.returncode == cli.BAD_INPUT
        assert "No space left" in done.stderr and "Traceback" not in done.stderr
