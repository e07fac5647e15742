# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn excite``: design a motion for identification."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import command
from skidyn._commands._input import read_robot
from skidyn._commands._output import print_json, working

DESCRIPTION = """\
Design a motion from which the parameters of a robot can be told, within its limits.

  skidyn excite --urdf robot.urdf --out motion.csv --duration 20

The motion is a Fourier series on every joint that starts and ends at rest. Positions, velocities
and torques keep the limits of the URDF. Play it on the robot, log it, then: skidyn diagnose.
"""


def add_parser(commands: Any) -> None:
    """Add the command to the parser."""
    parser = command(commands, "excite", run, "design a motion for identification", DESCRIPTION)
    parser.add_argument("--urdf", required=True, help="description of the robot")
    parser.add_argument("--joints", help="joints that move, separated by commas (default: all)")
    parser.add_argument("--out", required=True, metavar="CSV", help="motion to write")
    parser.add_argument("--duration", type=float, default=20.0, help="s (default: %(default)s)")
    parser.add_argument("--rate", type=float, default=100.0, help="Hz (default: %(default)s)")
    parser.add_argument(
        "--frequency", type=float, default=0.1, help="first harmonic, Hz (default: %(default)s)"
    )
    parser.add_argument(
        "--criterion",
        choices=("determinant", "condition"),
        default="determinant",
        help="what is made best (default: %(default)s)",
    )
    parser.add_argument("--seed", type=int, default=0)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from skidyn.excitation import design_excitation

    robot = read_robot(options)
    with working("Designing the motion", options):
        excitation = design_excitation(
            robot,
            duration=options.duration,
            base_frequency=options.frequency,
            criterion=options.criterion,
            random_state=options.seed,
        )
    excitation.to_csv(options.out, options.rate)
    path = str(Path(options.out).resolve())
    if options.json:
        print_json({"condition_number": excitation.condition_number, "csv": path})
        return
    print(f"condition number of the base regressor: {excitation.condition_number:.3g}")
    print(f"written: {path}")
