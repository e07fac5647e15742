# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn explore``."""

from __future__ import annotations

from pathlib import Path

import pytest

from skidyn import cli, explorer
from skidyn.explorer import Session


@pytest.fixture
def served(monkeypatch):
    """What the page would be served with."""
    told = {}

    def serve(session, folder, *, ready, **words):
        told.update(words, session=session, folder=folder)
        ready("http://127.0.0.1:1/?token=secret")

    monkeypatch.setattr(explorer, "serve", serve)
    return told


def test_the_page_gets_the_log_and_whole_paths_for_the_script(work, served, capsys, monkeypatch):
    monkeypatch.chdir(work)
    words = ["explore", "log.csv", "--urdf", "arm.urdf", "--folder", "results", "--no-browser"]
    assert cli.main(words) == cli.DONE
    assert "open http://127.0.0.1:1/?token=secret" in capsys.readouterr().out
    assert isinstance(served["session"], Session) and served["session"].robot.n_joints == 2
    assert served["folder"] == "results" and served["controller"] is None
    assert Path(served["urdf"]) == work / "arm.urdf"
    assert [Path(log) for log in served["logs"]] == [work / "log.csv"]


def test_a_program_gets_the_address_as_json_and_no_browser_opens(work, served, run, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    words = ("explore", work / "log.csv", "--urdf", work / "arm.urdf")
    code, told = run(*words, "--no-browser")
    assert (code, told) == (cli.DONE, {"address": "http://127.0.0.1:1/?token=secret"})
    assert opened == []
    run(*words)
    assert opened == ["http://127.0.0.1:1/?token=secret"]
