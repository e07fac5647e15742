# SPDX-License-Identifier: BSD-3-Clause
"""Every example of the gallery runs from the command line, in its small size."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.mark.slow
@pytest.mark.parametrize(
    "script", sorted(EXAMPLES.glob("**/plot_*.py")), ids=lambda path: path.stem
)
def test_example_runs(script, tmp_path, request):
    """``SKIDYN_SMALL=1`` asks an example for its small size; ``plot_real_*`` need recordings."""
    environment = dict(os.environ, SKIDYN_SMALL="1", MPLBACKEND="Agg")
    if script.stem.startswith("plot_real_"):
        environment["SKIDYN_DATA"] = str(request.getfixturevalue("data_dir"))
    done = subprocess.run(
        [sys.executable, "-W", "error::FutureWarning", str(script)],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
