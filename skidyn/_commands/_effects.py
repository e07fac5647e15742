# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn effects``: list the catalogue."""

from __future__ import annotations

import argparse
from typing import Any

from skidyn._commands._arguments import command
from skidyn._commands._output import print_json

DESCRIPTION = """\
List the kinds of effects that the diagnosis tests and that --model and --effect accept. --model
accepts no settings of servos (servo_gain and so on), which are stated in --controller. --json adds
formula, coefficients with units, shape parameters with ranges, rivals and references.

  skidyn effects
  skidyn effects --json
"""


def add_parser(commands: Any) -> None:
    command(commands, "effects", run, "list the catalogue of effects", DESCRIPTION)


def run(options: argparse.Namespace) -> None:
    from skidyn.effects import get_effect, list_effects

    catalogue = {kind: get_effect(kind).describe() for kind in list_effects()}
    if options.json:
        print_json(catalogue)
        return
    for kind, entry in catalogue.items():
        print(f"{kind:28s} {entry['title']}")
