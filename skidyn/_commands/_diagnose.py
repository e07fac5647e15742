# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn diagnose``: learn which effect is missing."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import command, with_log
from skidyn._commands._input import read_model_and_log
from skidyn._commands._output import (
    print_diagnosis,
    print_json,
    provenance,
    run_diagnosis,
    write_reports,
)

DESCRIPTION = """\
Compare a model with a log and learn which physical effect it lacks.

  skidyn diagnose run1.csv run2.csv --urdf robot.urdf --out report.json --html report.html

LOG is a table with the columns time, trajectory, q1.., dq1.., tau1.. (optional ddq1.., temp1..);
other names through --columns '{"q": ["pos_a", "pos_b"]}'. --model says what the model has already:
rigid_body and kinds of the catalogue (skidyn effects lists them).
"""


def add_parser(commands: Any) -> None:
    parser = command(commands, "diagnose", run, "learn which effect is missing", DESCRIPTION)
    with_log(parser)
    parser.add_argument("--out", metavar="JSON", help="write the report as JSON")
    parser.add_argument("--html", metavar="HTML", help="write the report as a page")
    parser.add_argument("--effects", help="kinds to try, separated by commas (default: all)")


def run(options: argparse.Namespace) -> None:
    model, frame, tau = read_model_and_log(options)
    diagnosis = run_diagnosis(model, frame, tau, options)
    write_reports(diagnosis, options.out, options.html, provenance(options))
    if options.json:
        print_json(diagnosis.to_dict())
    else:
        print_diagnosis(diagnosis)
        for path in filter(None, (options.out, options.html)):
            print(f"written: {Path(path).resolve()}")
