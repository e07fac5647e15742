# SPDX-License-Identifier: BSD-3-Clause
import json
from importlib import resources

import pytest

from skidyn.report import summarize, write_json


@pytest.mark.parametrize("verdict", ["complete", "missing", "unknown"])
def test_report_follows_the_schema(fakes, verdict, tmp_path):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(
        resources.files("skidyn.report").joinpath("diagnosis.schema.json").read_text()
    )
    summary = summarize(fakes.make_diagnosis(verdict), provenance={"files": {"a.csv": "12"}})
    jsonschema.Draft202012Validator.check_schema(schema)
    path = write_json(tmp_path / "report.json", summary["report"])
    report = json.loads(path.read_text())
    jsonschema.validate(report, schema)
    assert report["verdict"] == verdict
    assert report["provenance"]["files"] == {"a.csv": "12"}
    assert "numpy" in report["provenance"]["versions"]


def test_summary_is_pure_json(fakes):
    summary = summarize(fakes.make_diagnosis())
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_verdict_is_said_in_words(fakes):
    told = {
        verdict: summarize(fakes.make_diagnosis(verdict))["story"]["headline"]
        for verdict in ("complete", "missing", "unknown")
    }
    assert told["complete"] == "Nothing significant is missing"
    assert told["missing"] == "Missing: Dahl friction on joints 1 and 2 and spring on joint 3"
    assert "something that depends on q1 and q3 on joint 2" in told["unknown"]


def test_units_follow_the_joint_type(fakes):
    assert summarize(fakes.make_diagnosis())["units"] == ["N m", "N m", "N"]
