# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn diagnose``: identify missing effects."""

from __future__ import annotations

import argparse
import shlex
import warnings
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from skidyn._commands._arguments import (
    JsonFile,
    Page,
    command,
    number_of_processes,
    with_controller,
    with_log,
)
from skidyn._commands._earlier import stored
from skidyn._commands._input import read_inputs
from skidyn._commands._kept import Kept, noting
from skidyn._commands._output import (
    explain_motion,
    print_json,
    provenance,
    run_diagnosis,
    working,
)
from skidyn._commands._story import story_lines
from skidyn._exceptions import LogWarning, MisreadLogError
from skidyn._writing import write_json

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.diagnosis import Diagnosis
    from skidyn.measurement import Suspicion

DESCRIPTION = """\
Compare a model with a log and identify the physical effects that it lacks.

  skidyn diagnose run1.csv run2.csv --urdf robot.urdf --out report.json --html report.html

LOG is a table with the columns time, trajectory, q1.., dq1.., tau1.. (optional ddq1.., temp1..);
other names are given by --columns '{"q": ["pos_a", "pos_b"]}'. --model lists the components that
the model has already: rigid_body and kinds of the catalogue (printed by skidyn effects).

A log of position servos needs their commands (cmd1.. or q_ref1..) instead of torque: the torque is
the gain of the servo times its position error. Joints are then also simulated along their commands.

  skidyn diagnose servos.csv --urdf robot.urdf --controller fit \\
      --model rigid_body,viscous,coulomb,rotor_inertia
"""


def add_parser(commands: Any) -> None:
    parser = command(commands, "diagnose", run, "identify missing effects", DESCRIPTION)
    with_log(parser)
    parser.add_argument("--out", type=JsonFile, metavar="JSON", help="write the report as JSON")
    parser.add_argument("--html", type=Page, metavar="HTML", help="write the report as a page")
    parser.add_argument(
        "--force", action="store_true", help="continue although a check found an error in the log"
    )
    parser.add_argument(
        "--simulate",
        action="store_true",
        help="also judge findings by the simulated motion; findings that worsen it are not added",
    )
    with_controller(parser, "also identify effects by the motion of servos along their commands")
    parser.add_argument(
        "--no-cache",
        action="store_true",
        help="repeat the diagnosis even if a stored result exists, and store no result beside "
        "the log",
    )
    parser.add_argument(
        "--jobs",
        type=number_of_processes,
        default=-1,
        metavar="N",
        help="maximum number of processes (default: one for each core; one on systems other than "
        "Linux)",
    )
    parser.add_argument("--effects", help="kinds to try, separated by commas (default: all)")


def run(options: argparse.Namespace) -> None:
    kept = Kept(options)
    answer = kept.read()
    again = answer is not None and (answer["page"] is not None or not options.html)
    if answer is None or not again:
        answer = _answer(options)
        kept.write(answer)
    options.clock = answer["clock"]  # that of the report, for later commands
    for note in answer["noted"]:
        warnings.warn(note, LogWarning, stacklevel=2)
    if options.out:
        told = provenance(options, answer["changed"])
        write_json(options.out, {**answer["report"], "provenance": told})
    if options.html:
        from skidyn.report import write_html

        write_html(options.html, answer["page"])
    if options.json:
        print_json(answer["report"])
        return
    for line in story_lines(answer["story"], answer["failures"]):
        print(line)
    options.told = answer["told"]
    for path in filter(None, (options.out, options.html)):
        print(f"written: {Path(path).resolve()}")
    for line in _next(answer, options):
        print(line)
    if again:
        print("This is the stored result of an earlier identical diagnosis; --no-cache repeats it.")


def _answer(options: argparse.Namespace) -> dict[str, Any]:
    """The results, as values that can be stored."""
    from skidyn.diagnosis import separable_rivals

    of_the_log = options.controller is None
    with noting() as noted:
        try:
            diagnosis, frame = _diagnosed(options)
        except MisreadLogError as error:
            if options.clock != "auto" or {s.check for s in error.suspicions} != {"clock_jitter"}:
                raise
            of_the_log = False
            options = argparse.Namespace(**vars(options) | {"clock": "regular"})
            diagnosis, frame = _diagnosed(options)
            mended = [_mended(jitter) for jitter in error.suspicions]
            diagnosis.checks[:0] = mended
            diagnosis.warnings[:0] = map(str, mended)
        explain_motion(diagnosis, frame, options)
        if options.simulate:
            used = diagnosis.controller
            driven: dict[str, Any] = {} if used is None else {"controller": used}
            with working("Simulating", options):
                diagnosis.judge_by_simulation(**driven)
        page = None
        if options.html:
            from skidyn.report import summarize

            page = summarize(diagnosis, provenance=provenance(options, frame.attrs["notes"]))
    return {
        "report": diagnosis.to_dict(),
        "story": diagnosis.story(),
        "failures": [asdict(failure) for failure in diagnosis.failures],
        "rivals": any(separable_rivals(f.kind, f.rivals) for f in diagnosis.findings),
        "page": page,
        "told": list(diagnosis.warnings),
        "noted": noted,
        "changed": frame.attrs["notes"],
        "of_the_log": of_the_log,
        "compared": stored(diagnosis) if of_the_log else None,
        "clock": options.clock,
    }


def _diagnosed(options: argparse.Namespace) -> tuple[Diagnosis, pd.DataFrame]:
    """The diagnosis of the log read with the options, and the log."""
    _, model, frame, tau, controller = read_inputs(options, check=False)
    diagnosis = run_diagnosis(model, frame, tau, options, controller=controller)
    return diagnosis, frame


def _mended(jitter: Suspicion) -> Suspicion:
    """Note on time stamps that were replaced by even steps."""
    evidence = (
        f"{jitter.evidence}; even steps were used, as with --clock regular (--clock recorded "
        "keeps the stamps)"
    )
    return replace(jitter, evidence=evidence, certainty="noted", remedy=None)


def _next(answer: dict[str, Any], options: argparse.Namespace) -> list[str]:
    """Suggested next commands."""
    if not options.out:
        if options.html:
            return []
        return ["next: add --out report.json --html report.html to save this result as a page"]
    report = shlex.quote(options.out)
    story = answer["story"]
    seen = (story["servo_motion"] or {"findings": []})["findings"]
    known = [line for line in [*story["findings"], *seen] if line["kind"] != "unknown"]
    named = [line for line in known if not line.get("guess")]
    lines = []
    if named:
        joints = ",".join(map(str, named[0]["joints"]))
        kind = named[0]["kind"]
        lines.append(f"next: skidyn add --from {report} --effect {kind} --joints {joints}")
    if answer["rivals"]:
        lines.append(f"next: skidyn separate --from {report} --out motion.csv")
    return lines
