# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn compare``: held-out errors by joint, trajectory and regime."""

from __future__ import annotations

import argparse
from typing import Any

from skidyn._commands._arguments import command, with_log
from skidyn._commands._input import read_model_and_log
from skidyn._commands._output import print_comparison, print_json, print_regimes, run_diagnosis

DESCRIPTION = """\
Compare a model with a log: the error on motion that the fit has not seen, by joint and trajectory,
and by regime (at rest, around reversals, slow, fast, loaded). Nothing is searched.

  skidyn compare run*.csv --urdf robot.urdf
  skidyn compare run*.csv --urdf robot.urdf --model rigid_body,viscous,coulomb,stribeck
"""


def add_parser(commands: Any) -> None:
    parser = command(
        commands,
        "compare",
        run,
        "print the held-out error by joint, trajectory and regime",
        DESCRIPTION,
    )
    with_log(parser)


def run(options: argparse.Namespace) -> None:
    model, frame, tau = read_model_and_log(options)
    diagnosis = run_diagnosis(model, frame, tau, options, kinds=())
    comparison = diagnosis.comparison
    if options.json:
        print_json({"table": comparison.table(), "failures": [vars(f) for f in diagnosis.failures]})
        return
    print_comparison(comparison)
    print_regimes(diagnosis)
