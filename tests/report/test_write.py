# SPDX-License-Identifier: BSD-3-Clause
import pytest

from skidyn.report import summarize, write_html, write_json


def test_an_interrupted_write_leaves_the_old_file(tmp_path, monkeypatch):
    target = tmp_path / "report.json"
    target.write_text("old")

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("skidyn._writing.os.replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_json(target, {"new": 1})
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_folders_are_made(tmp_path, fakes):
    page = write_html(tmp_path / "a" / "b.html", summarize(fakes.make_diagnosis()))
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert write_json(tmp_path / "c" / "d.json", {"a": 1}).read_text() == '{\n  "a": 1\n}\n'
