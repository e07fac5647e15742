# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn payload``: the payload of the robot, or its drive gains from a known load."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from skidyn._checks import warn_about_log
from skidyn._commands._arguments import Input, JsonFile, command, with_log_only
from skidyn._commands._input import effects_option, json_option, read_frame, read_robot
from skidyn._commands._output import print_json, working
from skidyn._exceptions import SkidynError
from skidyn._writing import write_json

if TYPE_CHECKING:
    import pandas as pd

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
    loaded = _read(options, robot)
    options.logs = options.unloaded
    unloaded = _read(options, robot)
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
    if options.out:
        write_json(options.out, found.to_dict())
    if options.json:
        print_json(found.to_dict())
    else:
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


def _read(options: argparse.Namespace, robot: Robot) -> pd.DataFrame:
    """A log, checked with its torques, or without the robot if currents are expected."""
    from skidyn.logs import check_log

    currents = options.known_mass is not None
    frame = read_frame(options, robot, check=not currents)
    for message in check_log(frame).warnings if currents else ():
        warn_about_log(message)
    return frame
