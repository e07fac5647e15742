# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn diagnose``: learn which effect is missing."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

from skidyn._commands._arguments import JsonFile, Page, command, with_log
from skidyn._commands._input import read_model_and_log
from skidyn._commands._output import (
    print_diagnosis,
    print_json,
    provenance,
    run_diagnosis,
    working,
    write_reports,
)

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis

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
    parser.add_argument("--out", type=JsonFile, metavar="JSON", help="write the report as JSON")
    parser.add_argument("--html", type=Page, metavar="HTML", help="write the report as a page")
    parser.add_argument(
        "--force", action="store_true", help="continue although a check found the log to be wrong"
    )
    parser.add_argument(
        "--simulate",
        action="store_true",
        help="also judge findings by the simulated motion; those that worsen it are not added",
    )
    parser.add_argument("--effects", help="kinds to try, separated by commas (default: all)")


def run(options: argparse.Namespace) -> None:
    model, frame, tau = read_model_and_log(options, check=False)
    diagnosis = run_diagnosis(model, frame, tau, options)
    if options.simulate:
        with working("Simulating", options):
            diagnosis.judge_by_simulation()
    write_reports(diagnosis, options.out, options.html, provenance(options))
    if options.json:
        print_json(diagnosis.to_dict())
    else:
        print_diagnosis(diagnosis, options)
        for path in filter(None, (options.out, options.html)):
            print(f"written: {Path(path).resolve()}")
        for line in _next(diagnosis, options):
            print(line)


def _next(diagnosis: Diagnosis, options: argparse.Namespace) -> list[str]:
    """The commands that may follow."""
    if not options.out:
        if options.html:
            return []
        return ["next: the same with --out report.json --html report.html keeps this as a page"]
    if not diagnosis.findings:
        return []
    report = shlex.quote(options.out)
    named = [line for line in diagnosis.story()["findings"] if line["kind"] != "unknown"]
    lines = []
    if named:
        joints = ",".join(map(str, named[0]["joints"]))
        kind = named[0]["kind"]
        lines.append(f"next: skidyn add --from {report} --effect {kind} --joints {joints}")
    if any(finding.rivals for finding in diagnosis.findings):
        lines.append(f"next: skidyn separate --from {report} --out motion.csv")
    return lines
