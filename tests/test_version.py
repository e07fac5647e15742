# SPDX-License-Identifier: BSD-3-Clause
"""Versions of skidyn and of what it runs on."""

import skidyn


def test_version_is_that_of_the_installed_package():
    assert skidyn.__version__[0].isdigit()


def test_show_versions_prints_what_a_bug_report_needs(capsys):
    skidyn.show_versions()
    printed = capsys.readouterr().out
    for package in ("python", "skidyn", "scikit-learn", "torch", "numpy"):
        assert f"{package}: " in printed
