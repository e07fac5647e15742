# SPDX-License-Identifier: BSD-3-Clause
import json
from importlib import resources

import numpy as np
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


def test_missing_regimes_become_null(fakes):
    diagnosis = fakes.make_diagnosis()
    table = diagnosis.error_map()
    table[0, 0] = np.nan
    diagnosis.error_map = lambda after=False: table
    assert summarize(diagnosis)["where"]["errors"][0][0] is None


def test_verdict_is_said_in_words(fakes):
    told = {
        verdict: summarize(fakes.make_diagnosis(verdict))["story"]["headline"]
        for verdict in ("complete", "missing", "unknown")
    }
    assert told["complete"] == "Nothing significant is missing"
    assert told["missing"] == "Missing: Dahl friction on joints 1 and 2 and spring on joint 3"
    assert "something that depends on q1 and q3 on joint 2" in told["unknown"]


def test_trajectories_are_laid_end_to_end(fakes):
    trace = summarize(fakes.make_diagnosis())["time"]["traces"][0]
    assert [start["trajectory"] for start in trace["starts"]] == [0, 1, 2]
    assert [start["time"] for start in trace["starts"]] == pytest.approx([0, 10, 20], rel=0.02)
    # a line that goes on over a border would be drawn up or down
    assert trace["starts"][1]["time"] - 9.99 > 0.003 * 30
    assert (np.diff(trace["time"]) > 0).all()
    assert len(trace["breaks"]) == 2


def test_units_follow_the_joint_type(fakes):
    assert summarize(fakes.make_diagnosis())["units"] == ["N m", "N m", "N"]


def test_long_logs_are_thinned_without_losing_the_largest_residual(fakes):
    diagnosis = fakes.make_diagnosis(n_samples=300_000)
    trace = summarize(diagnosis)["time"]["traces"][0]
    assert len(trace["time"]) < 25_000
    residual = np.subtract(trace["measured"], trace["before"])
    whole = diagnosis.comparison.residual[:, 0]
    assert residual.max() == pytest.approx(whole.max())
    assert residual.min() == pytest.approx(whole.min())
