# SPDX-License-Identifier: BSD-3-Clause
"""Where the numbers of a page come from."""

import pytest


def test_files_and_versions_are_named(diagnosis_page):
    assert "files a.csv 12" in diagnosis_page["provenance"]
    assert "numpy" in diagnosis_page["provenance"]


@pytest.mark.parametrize("page", ["comparison_page", "fleet_page"])
def test_versions_are_named(page, request):
    assert "versions python" in request.getfixturevalue(page)["provenance"]
