# SPDX-License-Identifier: BSD-3-Clause
"""Every example of the gallery runs from the command line, in its small size.

Those that the documentation build has just run are not run a second time.
"""

import hashlib
import os
import runpy
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
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
    "script",
    sorted(set(EXAMPLES.glob("**/plot_*.py")) - set(EXAMPLES.glob("**/plot_real_*.py"))),
    ids=lambda path: path.stem,
)
def test_example_runs(script, tmp_path):
    """``SKIDYN_SMALL=1`` asks an example for its small size; those with recordings are below."""
    if ran_in_the_documentation(script):
        pytest.skip("the documentation build has run this very file")
    environment = dict(os.environ, SKIDYN_SMALL="1", MPLBACKEND="Agg")
    done = subprocess.run(
        [sys.executable, "-W", "error::FutureWarning", str(script)],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr


@pytest.fixture
def run(data_dir, monkeypatch):
    """Run an example and hand back its variables."""
    monkeypatch.setenv("SKIDYN_DATA", str(data_dir))
    monkeypatch.setenv("SKIDYN_SMALL", "1")

    def run_example(name):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the recordings' own faults are listed elsewhere
            return runpy.run_path(str(EXAMPLES / "4_real_robots" / name))

    return run_example


@pytest.mark.slow
def test_ur10e_effects_found_on_some_recordings_cut_the_error_of_others(run):
    result = run("plot_real_ur10e.py")

    kinds = {finding.kind for finding in result["diagnosis"].findings}
    assert "load_dependent_friction" in kinds
    assert "rotor_inertia" not in kinds
    assert {"dahl", "maxwell_slip", "lugre"} & kinds  # the reversals, which sliding rows leave out
    for part in ("from first to last motion", "while the joint moves"):
        assert result["RATIOS"]["50 s Fourier", part] < 0.70
        assert result["RATIOS"]["point to point", part] < 0.85
    assert [error.joint for error in result["REST"]] == [5, 6]
    assert all(error.beyond < 0.5 * error.rmse for error in result["REST"])


@pytest.mark.slow
def test_payloads_that_come_and_that_are_not_there(run):
    result = run("plot_real_payload.py")

    payload, absent = result["PAYLOAD"], result["ABSENT"]
    assert payload.kind == "payload"
    assert payload.joints == (6,)
    assert abs(payload.parameters["mass"]["value"] - 2.805) < 0.15 * 2.805
    assert "cannot separate mass from drive gain" in payload.sentence
    assert absent.kind == "payload"
    assert absent.joints == (7,)
    assert -0.85 < absent.parameters["mass"]["value"] < -0.55
