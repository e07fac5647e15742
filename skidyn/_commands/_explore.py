# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn explore``: interactive search for effects in a browser."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import command, with_controller, with_log
from skidyn._commands._input import covered_joints, find_suspicions, read_inputs, reading
from skidyn._commands._output import print_suspicions, working

DESCRIPTION = """\
Search for effects by hand on a local page: view the measurement against the model, click where the
model fails, see which effects would reduce the error there, add one and view the new error; undo
the last step, or save the result.

  skidyn explore run*.csv --urdf robot.urdf --folder results

The page is served on this machine only, with a random token in its address; no data leaves the
machine. Saving writes model.skops, report.html and explored.py, a script that repeats the steps.
Ctrl-C stops the server.
"""


def add_parser(commands: Any) -> None:
    parser = command(
        commands, "explore", run, "search for effects by hand in a browser", DESCRIPTION
    )
    with_log(parser)
    parser.add_argument("--folder", default=".", help="where results are saved (default: here)")
    parser.add_argument(
        "--port", type=int, default=0, help="port of the page (default: a free one)"
    )
    with_controller(
        parser, "compute the torque of a log without torque from the commands of its servos"
    )
    parser.add_argument("--no-browser", action="store_true", help="only print the address")


def run(options: argparse.Namespace) -> None:
    import webbrowser

    from skidyn.explorer import Session, serve

    robot, model, frame, tau, controller = read_inputs(options, check=False)
    checks = find_suspicions(frame, robot, options)
    with working("Preparing", options):
        session = Session(model, frame, tau)

    if not options.json:
        print_suspicions(checks)

    def ready(address: str) -> None:
        if options.json:
            print(json.dumps({"address": address}), flush=True)
        else:
            print(f"open {address}", flush=True)
        if not options.no_browser:
            webbrowser.open(address)

    serve(
        session,
        options.folder,
        # whole paths: the script is saved elsewhere and must find the files from anywhere
        logs=[str(Path(log).resolve()) for log in options.logs],
        urdf=str(Path(options.urdf).resolve()),
        joints=covered_joints(options),
        reading=reading(options),
        # the script computes the torque only if the log has none
        controller=None if "tau1" in frame else controller,
        checks=checks,
        port=options.port,
        ready=ready,
    )
