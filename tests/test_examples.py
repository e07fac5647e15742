# SPDX-License-Identifier: BSD-3-Clause
"""Every example of the gallery runs from the command line, in its small size.

Those that ``make docs`` has just run, in their full size, are not run a second time.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"


def ran_in_the_documentation(script):
    """The documentation build stores the checksum of an example once it has run to its end."""
    stored = ROOT / "docs" / "gallery" / f"{script.relative_to(EXAMPLES)}.md5"
    return stored.exists() and stored.read_text() == hashlib.md5(script.read_bytes()).hexdigest()


def test_gallery_is_large_enough_to_show_every_part():
    assert len(list(EXAMPLES.glob("**/plot_*.py"))) >= 12
    for folder in EXAMPLES.glob("*/"):
        assert (folder / "README.rst").exists(), f"{folder} has no README.rst"


@pytest.mark.slow
@pytest.mark.parametrize(
    "script", sorted(EXAMPLES.glob("**/plot_*.py")), ids=lambda path: path.stem
)
def test_example_runs(script, tmp_path, request):
    """``SKIDYN_SMALL=1`` asks an example for its small size; ``plot_real_*`` need recordings."""
    if ran_in_the_documentation(script):
        pytest.skip("the documentation build has run this very file")
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
