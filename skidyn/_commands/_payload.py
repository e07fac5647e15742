# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn payload``: the payload of the robot, or its drive gains from a known load."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from skidyn._commands._arguments import Input, JsonFile, command, with_log_only
from skidyn._commands._input import (
    effects_option,
    find_suspicions,
    json_option,
    read_frame,
    read_robot,
)
from skidyn._commands._output import print_json, print_suspicions, working
from skidyn._exceptions import SkidynError
from skidyn._writing import write_json

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.measurement import Suspicion
    from skidyn.robots import Robot

DESCRIPTION = """\
Identify a payload from runs with it (LOG) and without it (--unloaded): mass, centre of mass and
inertia with 95 % intervals. With --known-mass the drive gains are estimated instead: torque per
ampere of every joint, from logs of currents.

  skidyn payload loaded.csv --unloaded free.csv --urdf robot.urdf
  skidyn payload loaded.csv --unloaded free.csv --urdf robot.urdf --link tool0 --out payload.json
  skidyn payload loaded.csv --unloaded free.csv --urdf robot.urdf --known-mass 2.805
"""


def add_parser(commands: Any) -> None:
    parser = command(
        commands, "payload", run, "identify a payload, or drive gains from one", DESCRIPTION
    )
    with_log_only(parser)
    parser.add_argument(
        "--unloaded",
        nargs="+",
        type=Input,
        required=True,
        metavar="LOG",
        help="recordings without the payload, preferably of the same motion",
    )
    parser.add_argument(
        "--link",
        help="link that carries the payload, which is stated in the frame of this link "
        "(default: the last)",
    )
    parser.add_argument(
        "--com",
        metavar="X,Y,Z",
        help="centre of mass in the frame of the link in m, if known: determines the mass where "
        "the motion shows only the first moment of the payload",
    )
    parser.add_argument(
        "--model",
        default="rigid_body,viscous,coulomb,offset,rotor_inertia",
        help="components of the model of the unloaded robot, separated by commas (default: "
        "%(default)s)",
    )
    parser.add_argument(
        "--known-mass",
        type=float,
        metavar="KG",
        help="mass of the load: estimate the drive gains from logs of currents",
    )
    parser.add_argument("--out", type=JsonFile, metavar="JSON", help="write the result as JSON")


def run(options: argparse.Namespace) -> None:
    from skidyn.payload import estimate_drive_gains, identify_payload

    robot = read_robot(options)
    gains = options.drive_gains
    if options.known_mass is not None and gains is None:
        options.drive_gains = str([1.0] * robot.n_joints)  # the torques are the currents
    loaded, doubts = _read(options, robot)
    options.logs = options.unloaded
    unloaded, others = _read(options, robot)
    common: dict[str, Any] = {"link": options.link, "effects": effects_option(options.model)}
    if options.com is not None:
        common["com"] = _numbers(options.com)
    found: Any
    with working("Identifying", options):
        if options.known_mass is None:
            found = identify_payload(robot, loaded, unloaded, **common)
        else:
            common["drive_gains"] = json_option("drive-gains", gains)
            found = estimate_drive_gains(robot, loaded, unloaded, options.known_mass, **common)
    checks = {"loaded": doubts, "unloaded": others}
    told = {name: [check.to_dict() for check in own] for name, own in checks.items()}
    content = {**found.to_dict(), "checks": told}
    if options.out:
        write_json(options.out, content)
    if options.json:
        print_json(content)
        return
    print_suspicions(doubts, "the recordings with the payload")
    print_suspicions(others, "the recordings without it")
    print(found.text)


def _numbers(text: str) -> list[float]:
    """Three numbers."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3:
        raise SkidynError(f"--com is {text!r}; expected three numbers in m, such as 0,0,0.1")
    return values


def _read(options: argparse.Namespace, robot: Robot) -> tuple[pd.DataFrame, tuple[Suspicion, ...]]:
    """A log, and suspicions about it; currents have another scale than torques by themselves."""
    frame = read_frame(options, robot, check=False)
    found = find_suspicions(frame, robot, options)
    if options.known_mass is not None:
        found = tuple(check for check in found if check.check != "torque_scale")
    return frame, found
