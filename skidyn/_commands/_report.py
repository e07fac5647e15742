# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn report``: turn a report into a page."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import Page, command, with_report
from skidyn._commands._input import read_inputs, recorded_options
from skidyn._commands._output import (
    explain_motion,
    print_json,
    provenance,
    run_diagnosis,
    write_page,
)

DESCRIPTION = """\
Turn a report into one HTML page that needs no network. The log is read again and the diagnosis is
repeated; a warning is issued if a file has changed since.

  skidyn report --from report.json --html report.html
"""


def add_parser(commands: Any) -> None:
    parser = command(
        commands, "report", run, "turn the log of a report.json into a page", DESCRIPTION
    )
    with_report(parser)
    parser.add_argument("--html", type=Page, required=True, help="page to write")


def run(options: argparse.Namespace) -> None:
    options = recorded_options(options)
    # a diagnosis checks the log
    _, model, frame, tau, controller = read_inputs(options, check=False)
    diagnosis = run_diagnosis(model, frame, tau, options, controller=controller)
    explain_motion(diagnosis, frame, options)
    write_page(diagnosis, options.html, provenance(options, frame.attrs["notes"]))
    page = str(Path(options.html).resolve())
    if options.json:
        print_json({"html": page})
    else:
        print(f"written: {page}")
