# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn check``: quality of a log, before any model is fitted."""

from __future__ import annotations

import argparse
import shlex
import warnings
from collections.abc import Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from skidyn._commands._arguments import command, with_log_only
from skidyn._commands._input import read_frame, read_robot
from skidyn._commands._output import print_json, working
from skidyn._exceptions import LogWarning

if TYPE_CHECKING:
    from skidyn.logs import LogQuality

DESCRIPTION = """\
Check whether the signals of a log agree with their names and units. A table gives the rate, the
resolution, and the range and number of reversals of each joint. Problems are then listed by their
influence on the results, with evidence and the option that fixes each: failed reads, units, clock,
repeated rows, and with a robot also signs and order of joints, gravity, torque without sign,
currents taken for torques, and delay.

  skidyn check run1.csv run2.csv
  skidyn check run1.csv --urdf robot.urdf

In the table, "at rest" is the share of rows in which the joint does not move, "at limit" the share
of rows at the extreme torque, "dq/q'" the ratio of recorded velocity to differentiated position,
which is 1 in a consistent log, and "delay" that of the torque.
"""


def add_parser(commands: Any) -> None:
    parser = command(commands, "check", run, "judge the quality of a log", DESCRIPTION)
    with_log_only(parser, urdf_required=False)


def run(options: argparse.Namespace) -> None:
    from skidyn.logs import check_log

    robot = read_robot(options) if options.urdf else None
    with warnings.catch_warnings():
        if not options.json:  # the notes are printed above the checks
            warnings.simplefilter("ignore", LogWarning)
        frame = read_frame(options, robot, check=False)
    with ExitStack() as checking:

        def show(measured: LogQuality) -> None:
            if not options.json:
                for note in frame.attrs["notes"]:
                    print(f"note: {note}")
                print(measured.motion_table, flush=True)
            checking.enter_context(working("Checking", options))

        quality = check_log(frame, robot, measured=show)
    if options.json:
        print_json(quality.to_dict())
    else:
        for part in filter(None, (quality.torque_table, quality.problems)):
            print(f"\n{part}")
        remedies = [c.remedy.option for c in quality.checks if c.remedy and c.certainty != "noted"]
        if remedies:
            print("\nto fix all of these problems and check again:")
            print(f"  skidyn {shlex.join(_with_remedies(options.words, remedies))}")


def _with_remedies(words: Sequence[str], remedies: Sequence[str]) -> list[str]:
    """The arguments of a command with the options that correct its log.

    A value of an option that is present already is joined with its value, because only the last of
    two options with one name counts; an option without a value is given once.
    """
    fixed = list(words)
    for remedy in remedies:
        flag, _, value = remedy.partition(" ")
        if value and flag in fixed[:-1]:
            fixed[fixed.index(flag) + 1] += f",{value}"
        elif value or flag not in fixed:
            fixed += [flag, value] if value else [flag]
    return fixed
