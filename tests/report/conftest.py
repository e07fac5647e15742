# SPDX-License-Identifier: BSD-3-Clause
"""Made-up diagnoses for the tests of the report."""

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("jinja2", reason="needs skidyn[report]")


@pytest.fixture(scope="session")
def fakes():
    """The module fakes.py beside this file (import-mode importlib puts no folder on the path)."""
    path = Path(__file__).with_name("fakes.py")
    specification = importlib.util.spec_from_file_location("skidyn_report_fakes", path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module
