# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn compare``: a model with a log; or two models, or two recordings, with each other."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import Input, Page, TestReport, Traces, command, with_log
from skidyn._commands._earlier import earlier_checks, earlier_diagnosis
from skidyn._commands._gate import gate
from skidyn._commands._input import read_inputs, recorded_options
from skidyn._commands._output import (
    print_comparison,
    print_json,
    print_regimes,
    provenance,
    run_diagnosis,
)
from skidyn._exceptions import SkidynError
from skidyn._text import digits
from skidyn._writing import writable

DESCRIPTION = """\
Compare a model with a log: print the error on motion that was left out of the fit, by joint and
trajectory, and by regime (at rest, around reversals, slow, fast, loaded). No effects are searched.
--traces writes the torques and their difference for PlotJuggler, Foxglove, ROS 2 (.mcap) or Rerun
(.rrd).

  skidyn compare run*.csv --urdf robot.urdf
  skidyn compare run*.csv --urdf robot.urdf --model rigid_body,viscous,coulomb,stribeck
  skidyn compare run*.csv --urdf robot.urdf --traces errors.mcap

Compare two models, two recordings, or two reports of skidyn diagnose: both are diagnosed, and their
curves, errors, findings and coefficients are shown side by side on a page and written to a JSON
file beside it.

  skidyn compare run*.csv --urdf robot.urdf --against-model better.skops --html models.html
  skidyn compare new*.csv --urdf robot.urdf --against worn*.csv --html wear.html
  skidyn compare new.json worn.json --html wear.html

With --fail-above, the command is a test of the robot: the model is fitted to a healthy recording,
and the error of a joint on the new recording must not exceed the given multiple of its usual error.
If a joint fails, its name is printed and the exit code is 1.

  skidyn compare new*.csv --urdf robot.urdf --against healthy*.csv --fail-above 1.5
"""


def add_parser(commands: Any) -> None:
    parser = command(
        commands,
        "compare",
        run,
        "print held-out errors by joint, trajectory and regime, or compare two models or logs",
        DESCRIPTION,
    )
    with_log(parser, urdf_required=False)
    parser.add_argument(
        "--against", nargs="+", type=Input, metavar="LOG", help="the other recording"
    )
    parser.add_argument(
        "--against-model", type=Input, metavar="MODEL", help="the other model, as --model"
    )
    parser.add_argument("--names", metavar="A,B", help="names of the two sides on the page")
    parser.add_argument(
        "--html",
        type=Page,
        metavar="HTML",
        help="page that compares both; a JSON file of its numbers is written beside it",
    )
    parser.add_argument(
        "--traces",
        type=Traces,
        metavar="FILE",
        help="measured, predicted and residual torque of one log as .mcap or .rrd",
    )
    parser.add_argument(
        "--fail-above",
        type=float,
        metavar="RATIO",
        help="fail if a joint's error is more than RATIO times that of --against",
    )
    parser.add_argument(
        "--junit", type=TestReport, metavar="XML", help="result of --fail-above for test reports"
    )


def run(options: argparse.Namespace) -> bool | None:
    if options.fail_above is not None or options.junit:
        return gate(options)
    pair = _pair(options)
    if pair is None:
        _compare_with_log(options)
        return None
    if options.traces:
        raise SkidynError(
            "--traces writes one model on one log: leave out --against and --against-model"
        )
    from skidyn.report import summarize_comparison, write_html, write_json

    numbers = Path(options.html).with_suffix(".json") if options.html else None
    if numbers:
        writable(numbers)  # before the work: both files are written, or neither
    names = options.names.split(",") if options.names else _names(options, pair)
    diagnoses = _diagnosed(*pair)
    sources = [provenance(side) for side in pair]
    summary = summarize_comparison(*diagnoses, names=names, provenance=sources)
    files = []
    if numbers:
        files = [write_html(options.html, summary), write_json(numbers, summary["report"])]
    if options.json:
        print_json(summary["report"])
        return None
    _print_pair(summary)
    for path in files:
        print(f"written: {path.resolve()}")
    return None


def _compare_with_log(options: argparse.Namespace) -> None:
    if options.html or options.names:
        raise SkidynError(
            "--html and --names compare two: add --against, --against-model, or give two reports. "
            "The page of one model and one log is made by skidyn diagnose --html"
        )
    # a diagnosis checks the log
    robot, model, frame, tau, _ = read_inputs(options, check=False)
    checks = earlier_checks(options)
    diagnosis = run_diagnosis(model, frame, tau, options, kinds=(), checks=checks)
    comparison = diagnosis.comparison
    if options.traces:
        from skidyn.export import write_traces

        if len(comparison.measured) < len(frame):  # recordings that occur twice count once
            frame = frame[frame["trajectory"].isin(comparison.signals.trajectory)]
        torques = comparison.measured, comparison.predicted
        write_traces(options.traces, frame, *torques, robot)
    if options.json:
        print_json(
            {"table": comparison.table(), "failures": [asdict(f) for f in diagnosis.failures]}
        )
        return
    for note in diagnosis.warnings:
        print(f"  ! {note}")
    options.told = list(diagnosis.warnings)
    print_comparison(comparison)
    print_regimes(diagnosis)
    if options.traces:
        print(f"written: {Path(options.traces).resolve()}")


def _pair(options: argparse.Namespace) -> list[argparse.Namespace] | None:
    """Options of either side; None if there is only one."""
    reports = [name for name in options.logs if name.endswith(".json")]
    if reports:
        if len(options.logs) != 2 or len(reports) != 2:
            raise SkidynError("exactly two reports of skidyn diagnose can be compared")
        both = [argparse.Namespace(report=n, json=options.json, urdf=options.urdf) for n in reports]
        return [recorded_options(side) for side in both]
    if not options.urdf:
        raise SkidynError("--urdf is missing: give the description of the robot")
    if not options.against and not options.against_model:
        return None
    other = {"logs": options.against or options.logs}
    if options.against_model:
        other["model"] = options.against_model
    return [options, argparse.Namespace(**{**vars(options), **other})]


def _names(options: argparse.Namespace, pair: list[argparse.Namespace]) -> list[str]:
    """Names from the difference: models, or files."""
    models = [side.model for side in pair]
    if options.urdf and not options.against:
        names = models
    else:
        of = options.logs if not options.urdf else [side.logs[0] for side in pair]
        names = [Path(name).stem for name in of]
    return names if names[0] != names[1] else ["first", "second"]


def _diagnosed(one: argparse.Namespace, other: argparse.Namespace) -> list[Any]:
    """Diagnoses of both sides, stored ones if possible; common parts are computed once."""
    found: list[Any] = []
    for side in (one, other):
        same_log = bool(found) and _but_for(side, "model") == _but_for(one, "model")
        if same_log and side.model == one.model:
            return [*found, *found]
        _, model, frame, tau, _ = read_inputs(side, check=False)  # a diagnosis checks it
        diagnosis: Any = earlier_diagnosis(side, model, frame, tau)
        if diagnosis is None:
            checks = getattr(found[0], "checks", None) if same_log else None
            diagnosis = run_diagnosis(model, frame, tau, side, checks=checks)
        found.append(diagnosis)
    return found


def _but_for(options: argparse.Namespace, *names: str) -> dict[str, Any]:
    """The options without some of them."""
    left_out = {*names, "report", "against", "against_model", "told"}
    return {name: value for name, value in vars(options).items() if name not in left_out}


def _print_pair(summary: dict[str, Any]) -> None:
    report = summary["report"]
    (a, b), (first, second) = report["sides"], report["names"]
    print(f"{summary['headline']}.")
    print(summary["sentence"])
    print()
    print(f"held-out error: A is {first}, B is {second}")
    heads = "".join(f"{head:>9s}" for head in ("A", "B", "noise"))
    print(f"  {'joint':28s}{heads}      {'A':>9s}{'B':>9s}  with the findings")
    for j, name in enumerate(report["joints"]):
        given = (a["rmse_before"][j], b["rmse_before"][j], a["noise"][j])
        added = (a["rmse_after"][j], b["rmse_after"][j])
        cells = ["".join(f"{digits(value):>9s}" for value in part) for part in (given, added)]
        print(f"  {f'{name} ({j + 1})':28s}{cells[0]} {report['units'][j]:3s}  {cells[1]}")
    if report["findings"]:
        print()
        print("What is missing")
    for finding in report["findings"]:
        title = " or ".join(dict.fromkeys(filter(None, finding["titles"])))
        where = "in both" if len(finding["in"]) == 2 else f"missing only in {finding['in'][0]}"
        print(f"  {title} on joint {finding['joint']}: {where}")
