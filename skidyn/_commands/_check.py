# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn check``: how good a log is, before any model is fitted."""

from __future__ import annotations

import argparse
from typing import Any

from skidyn._commands._arguments import command, with_log_only
from skidyn._commands._input import read_frame, read_robot
from skidyn._commands._output import print_json, working

DESCRIPTION = """\
Judge the quality of a log before any model is fitted: rate, jitter, gaps, repeated rows, step of
the position sensors, saturation, velocity against differentiated position, delay of the torque, and
how far and how often each joint was moved. What looks wrong is said with its evidence.

  skidyn check run1.csv run2.csv
  skidyn check run1.csv --urdf robot.urdf     also limits, delay, and currents taken for torques

at rest: share of rows in which the joint stands; at limit: share of rows at the extreme torque;
dq/q': recorded velocity over differentiated position, 1 in a consistent log; delay: of the torque.
"""


def add_parser(commands: Any) -> None:
    parser = command(commands, "check", run, "judge the quality of a log", DESCRIPTION)
    with_log_only(parser, urdf_required=False)


def run(options: argparse.Namespace) -> None:
    from skidyn.datasets import check_log

    robot = read_robot(options) if options.urdf else None
    frame = read_frame(options, robot, check=False)
    with working("Checking", options):
        quality = check_log(frame, robot)
    if options.json:
        print_json(quality.to_dict())
    else:
        for note in frame.attrs["notes"]:
            print(f"note: {note}")
        print(quality)
