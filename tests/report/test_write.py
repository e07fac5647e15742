# SPDX-License-Identifier: BSD-3-Clause
import re

import pytest

from skidyn.report import (
    render_html,
    summarize,
    summarize_comparison,
    write_html,
    write_json,
)


def test_story_is_told_in_order(fakes):
    page = render_html(summarize(fakes.make_diagnosis()))
    order = [
        "Missing: ", "Where the model fails", "What is missing", "Error after each step",
        "Remaining error", "Largest undetected effects", "Terms", "Provenance",
    ]  # fmt: skip
    places = [page.index(f"<h2>{title}") for title in order]
    assert places == sorted(places)
    assert "diagnosis.add(&#34;dahl&#34;, joints=[1, 2])" in page


def test_a_complete_model_has_no_findings_to_show(fakes):
    page = render_html(summarize(fakes.make_diagnosis("complete")))
    assert "<h2>Nothing significant is missing" in page
    assert "<h2>What is missing" not in page and "<h2>Error after each" not in page


def test_numbers_of_the_page_are_those_of_the_report(fakes):
    summary = summarize(fakes.make_diagnosis())
    page = render_html(summary)
    before = [float(x) for x in re.findall(r'data-before="([^"]+)"', page)]
    after = [float(x) for x in re.findall(r'data-after="([^"]+)"', page)]
    assert sorted(before) == pytest.approx(sorted(summary["report"]["rmse_before"]))
    assert sorted(after) == pytest.approx(sorted(summary["report"]["rmse_after"]))


def test_markup_in_names_is_escaped(fakes):
    first, second = fakes.make_diagnosis(), fakes.make_diagnosis(n_samples=1500)
    page = render_html(summarize_comparison(first, second, names=(fakes.HOSTILE, "b")))
    assert "<img" not in page and page.count("</script>") == 3


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


def test_one_joint_is_counted_in_the_singular(fakes):
    one = fakes.make_diagnosis("complete", joint_names=("slide",), n_samples=1500)
    page = render_html(summarize(one))
    assert "1 joint · 3 trajectories · 1,500 samples" in page
    both = summarize_comparison(one, fakes.make_diagnosis("complete", ("slide",)), names=("a", "b"))
    assert "samples) · 1 joint<" in render_html(both) and "joints" not in both["sentence"]
