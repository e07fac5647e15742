# SPDX-License-Identifier: BSD-3-Clause
"""A log that is written to a file and read again with options."""

import pytest

from skidyn.logs import read_log


@pytest.fixture
def read(tmp_path):
    def run(frame, **options):
        frame.to_csv(tmp_path / "log.csv", index=False)
        return read_log(tmp_path / "log.csv", check=False, **options)

    return run
