# SPDX-License-Identifier: BSD-3-Clause
"""Settings and fixtures of the whole test suite."""

import os
from pathlib import Path

# One thread per worker: pytest-xdist already uses the cores, and results must not depend on how
# many there are. Set before NumPy and torch read them.
for _variable in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

import pytest  # noqa: E402

REPOSITORY = Path(__file__).resolve().parents[1]


def find_data_dir() -> Path | None:
    """Folder of the real recordings: ``$SKIDYN_DATA``, else ``../shared/data``, else None."""
    named = os.environ.get("SKIDYN_DATA")
    folder = Path(named) if named else REPOSITORY.parent / "shared" / "data"
    return folder if folder.is_dir() else None


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of the real recordings; the test is skipped where there is none."""
    folder = find_data_dir()
    if folder is None:
        pytest.skip("real recordings not found; set SKIDYN_DATA to their folder")
    return folder


@pytest.fixture
def saved(tmp_path):
    """Writes a table as CSV and returns its path."""

    def save(frame, name="log.csv"):
        frame.to_csv(tmp_path / name, index=False)
        return tmp_path / name

    return save
