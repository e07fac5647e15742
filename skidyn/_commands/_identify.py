# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn identify``: identify parameters."""

from __future__ import annotations

import argparse
from typing import Any

from skidyn._commands._arguments import command, with_log
from skidyn._commands._input import read_model_and_log
from skidyn._commands._output import parameters, print_json, working, write_json

DESCRIPTION = """\
Identify inertial parameters and effects together and print them with standard errors that survive
autocorrelation. Masses themselves are rarely visible; printed are the combinations that are.

  skidyn identify run*.csv --urdf robot.urdf --out parameters.json
  skidyn identify run*.csv --urdf robot.urdf --consistent     only bodies that can exist
"""


def add_parser(commands: Any) -> None:
    parser = command(commands, "identify", run, "identify parameters and print them", DESCRIPTION)
    with_log(parser)
    parser.add_argument("--out", metavar="JSON", help="write the parameters as JSON")
    parser.add_argument("--consistent", action="store_true", help="only bodies that can exist")


def run(options: argparse.Namespace) -> None:
    model, frame, tau = read_model_and_log(options)
    model.set_params(consistent=options.consistent)
    with working("Identifying", options):
        model.fit(frame, tau)
    content = parameters(model)
    if options.out:
        write_json(options.out, content)
    if options.json:
        print_json(content)
        return
    for row in model.parameter_table():
        print(f"{row['value']:12.5g} ± {row['std']:9.2g}   {row['name']}")
