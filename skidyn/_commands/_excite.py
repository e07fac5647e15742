# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn excite``: design a motion for identification."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import Input, Motion, command, with_reading
from skidyn._commands._input import json_option, read_inputs, read_robot
from skidyn._commands._output import print_json, working
from skidyn._exceptions import SkidynError

DESCRIPTION = """\
Design a motion within the limits of a robot from which its parameters can be identified.

  skidyn excite --urdf robot.urdf --out motion.csv --duration 20
  skidyn excite --urdf robot.urdf --recorded run1.csv --out next.csv
  skidyn excite --urdf robot.urdf --limits '{"workspace": [[-1, 1], [-1, 1], [0.1, 2]]}' ...

Every joint starts and ends at rest. Positions, velocities and torques stay within the limits of the
URDF, or those of --limits. With --recorded, the motion complements these logs, and the torque
limits apply to the model that is fitted to them, including friction. Collisions are not checked:
run the motion slowly at first. Then run it on the robot, log it, and use skidyn diagnose.
"""


def add_parser(commands: Any) -> None:
    parser = command(commands, "excite", run, "design a motion for identification", DESCRIPTION)
    parser.add_argument("--urdf", type=Input, required=True, help="description of the robot")
    parser.add_argument("--out", type=Motion, required=True, metavar="CSV", help="motion to write")
    parser.add_argument("--duration", type=float, default=20.0, help="in s (default: %(default)s)")
    parser.add_argument(
        "--sampling",
        type=float,
        default=100.0,
        metavar="HZ",
        help="samples of the motion per second (default: %(default)s)",
    )
    parser.add_argument(
        "--motion",
        choices=("fourier", "quintic"),
        default="fourier",
        help="Fourier series, or quintics between points (default: %(default)s)",
    )
    parser.add_argument(
        "--frequency", type=float, default=0.1, help="first harmonic, Hz (default: %(default)s)"
    )
    parser.add_argument(
        "--criterion",
        choices=("determinant", "condition"),
        default="determinant",
        help="criterion to optimize (default: %(default)s)",
    )
    parser.add_argument(
        "--limits",
        metavar="JSON",
        help="position, velocity, acceleration, torque by joint; workspace, a box in m",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the random starting points")
    parser.add_argument(
        "--recorded",
        nargs="+",
        type=Input,
        metavar="LOG",
        help="existing recordings, one or more files",
    )
    parser.add_argument(
        "--model",
        default="rigid_body,viscous,coulomb",
        help="components of the model fitted to the recordings (default: %(default)s)",
    )
    with_reading(parser)


def run(options: argparse.Namespace) -> None:
    from skidyn.excitation import MotionLimits, design_excitation

    given = json_option("limits", options.limits) or {}
    known = tuple(MotionLimits.__dataclass_fields__)
    if not isinstance(given, dict) or not set(given) <= set(known):
        raise SkidynError(f"--limits is {options.limits}; expected an object of {', '.join(known)}")
    model: Any = read_robot(options)
    recorded: Any = ()
    if options.recorded:
        options.logs, options.nominal = options.recorded, False
        _, model, recorded, tau, _ = read_inputs(options)
        with working("Identifying", options):
            model.fit(recorded, tau)
    with working("Designing the motion", options):
        excitation = design_excitation(
            model,
            duration=options.duration,
            motion=options.motion,
            base_frequency=options.frequency,
            criterion=options.criterion,
            limits=MotionLimits(**given),
            recorded=recorded,
            random_state=options.seed,
        )
    excitation.to_csv(options.out, options.sampling)
    path = str(Path(options.out).resolve())
    if options.json:
        print_json({"condition_number": excitation.condition_number, "csv": path})
        return
    together = ", recordings included" if options.recorded else ""
    print(f"condition number of the base regressor{together}: {excitation.condition_number:.3g}")
    print(f"written: {path}")
