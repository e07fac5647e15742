# SPDX-License-Identifier: BSD-3-Clause
"""Where the numbers of a diagnosis come from."""


def test_files_and_versions_are_named(diagnosis_page):
    assert "files a.csv 12" in diagnosis_page["provenance"]
    assert "numpy" in diagnosis_page["provenance"]
