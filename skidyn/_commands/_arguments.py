# SPDX-License-Identifier: BSD-3-Clause
"""Arguments that several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

from skidyn._commands._terminal import TeachingFormatter
from skidyn._writing import keep, writable


class Input(str):
    """A file that a command reads, and never writes."""


def number_of_processes(text: str) -> int:
    """A number of processes from 1 on, or -1 for one on each core."""
    number = int(text) if text.removeprefix("-").isdigit() else 0
    if number < 1 and number != -1:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no number of processes; expected 1 or more, or -1 for one on each core"
        )
    return number


class Output(str):
    """A file that a command writes; its ending determines its kind.

    If a glob of the shell follows ``--out``, it is a recording, whose ending is not that of a
    result.
    """

    endings: tuple[str, ...] = ()

    def __new__(cls, name: str) -> Output:
        if cls.endings and not name.lower().endswith(cls.endings):
            raise argparse.ArgumentTypeError(
                f"{name!r} must end in {' or '.join(cls.endings)}, which decides the format"
            )
        return super().__new__(cls, name)


def _ending(*allowed: str) -> type[Output]:
    class File(Output):
        endings = allowed

    return File


#: Results as JSON or as a page, and a motion as a table.
JsonFile, Page, Motion = _ending(".json"), _ending(".html", ".htm"), _ending(".csv")
#: Signals for a log viewer, and a result for tools that collect tests.
Traces, TestReport = _ending(".mcap", ".rrd"), _ending(".xml")


def check_files(options: argparse.Namespace) -> None:
    """Refuse outputs that cannot be written or would replace an input, before the computation."""
    keep(word for word in _words(options) if isinstance(word, Input))
    for word in _words(options):
        if isinstance(word, Output):
            writable(word)


def _words(options: argparse.Namespace) -> Iterator[Any]:
    for value in vars(options).values():
        yield from value if isinstance(value, list) else [value]


def command(commands: Any, name: str, run: Any, text: str, description: str = "") -> Any:
    parser = commands.add_parser(
        name,
        help=text,
        description=description or text,
        formatter_class=TeachingFormatter,
    )
    parser.set_defaults(run=run)
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    return parser


def with_log_only(parser: Any, urdf_required: bool = True) -> None:
    """Arguments for logs, robot and columns."""
    parser.add_argument(
        "logs", nargs="+", type=Input, metavar="LOG", help="recordings, one or more files"
    )
    parser.add_argument(
        "--urdf",
        type=Input,
        required=urdf_required,
        metavar="URDF",
        help="description of the robot: URDF, SDF or MJCF",
    )
    with_reading(parser)


def with_reading(parser: Any) -> None:
    """Arguments for the columns of logs."""
    parser.add_argument(
        "--columns",
        metavar="JSON",
        help='which columns hold which signals: {"q": ["pos_a", "pos_b"], "tau": [...]}, or '
        'patterns: "q=position_{i},tau=effort_{joint}"',
    )
    parser.add_argument(
        "--units", metavar="UNITS", help='units that are not SI: q=deg,time=ms or {"q": "deg"}'
    )
    parser.add_argument(
        "--drive-gains",
        metavar="JSON",
        help="torque per ampere of each joint, for logs of currents",
    )
    parser.add_argument("--joints", help="joints the log covers, separated by commas")
    parser.add_argument("--rate", type=float, help="sampling rate in Hz of a log without time")
    parser.add_argument(
        "--topics",
        metavar="NAMES",
        help="topics of a bag or groups of an HDF5 file, separated by commas (default: all with "
        "joint states)",
    )
    with_remedies(parser)


def with_remedies(parser: Any) -> None:
    """Remedies for a log with wrong signals, as reported by skidyn check."""
    fix = parser.add_argument_group("remedies", "skidyn check reports which of them a log needs")
    fix.add_argument(
        "--gravity",
        metavar="X,Y,Z",
        help="gravity in the base frame, m/s^2 (for a robot on a wall), or none if it was removed "
        "from the torque",
    )
    _with_column_remedies(fix)
    _with_row_remedies(fix)
    fix.add_argument(
        "--restore-gravity",
        action="store_true",
        help="add the gravity torque that was removed from the torque",
    )
    fix.add_argument(
        "--resample", type=float, metavar="HZ", help="average over even steps at this rate"
    )


def _with_column_remedies(fix: Any) -> None:
    """Remedies that change signals."""
    fix.add_argument(
        "--flip",
        metavar="JOINT,..",
        help="change the sign of a joint (its torque), q3 (its motion), or a column such as dq3",
    )
    fix.add_argument(
        "--order",
        metavar="2,1,3",
        help="for each joint the number of its column, for all or some quantities: tau=2,1,3, "
        "motion=2,1,3",
    )
    fix.add_argument(
        "--combine",
        metavar="tau6=tau6+tau7,..",
        help="replace columns by sums of recorded columns, as for the motors of a differential: "
        "tau6=tau6+tau7,tau7=tau6-tau7",
    )
    fix.add_argument(
        "--gain", metavar="tau3=0.02", help="multiply columns or quantities by factors"
    )
    fix.add_argument(
        "--summed",
        metavar="q3=q2",
        help="positions that include the position of another joint: q3=q2",
    )
    fix.add_argument(
        "--zero",
        metavar="q2=1.57",
        help="recorded positions at the robot's zero; recorded velocities at rest: dq2=0.1",
    )
    fix.add_argument(
        "--late",
        metavar="tau=0.008",
        help="delays in s that are removed; 0.013+0.0005*t for one that grows with the time since "
        "the beginning of a recording",
    )
    fix.add_argument(
        "--lowpass",
        metavar="tau=0.04",
        help="time constants in s of low-pass filters that are undone",
    )
    fix.add_argument(
        "--derive",
        metavar="dq2",
        help="velocities that are replaced by differentiated positions; dq for all",
    )
    fix.add_argument(
        "--unwrap",
        action="store_true",
        help="remove jumps by whole turns, or by the range of a counter",
    )
    fix.add_argument(
        "--torque-sign",
        choices=("recorded", "command"),
        default="recorded",
        help="command: magnitudes get the sign of commanded minus measured position",
    )


def _with_row_remedies(fix: Any) -> None:
    """Remedies for time stamps, and for rows that cannot be used."""
    fix.add_argument(
        "--clock",
        choices=("auto", "recorded", "regular"),
        default="auto",
        help="regular: samples were taken at even steps and only the time stamps jitter; recorded: "
        "the stamps are correct; auto (default): the stamps are used, except that a diagnosis "
        "uses even steps if the stamps certainly jitter",
    )
    fix.add_argument(
        "--missing",
        choices=("error", "drop"),
        default="error",
        help="drop: leave out rows with missing or infinite values (default: refuse the log)",
    )
    fix.add_argument(
        "--placeholder",
        metavar="9999,q=-1,..",
        help="values that stand for failed reads, of all signals, quantities or columns; rows with "
        "exactly such a value are left out",
    )
    fix.add_argument(
        "--drop-repeated", action="store_true", help="leave out rows that repeat the one before"
    )
    fix.add_argument(
        "--split-leaps", action="store_true", help="begin a new trajectory where positions jump"
    )


def with_log(parser: Any, urdf_required: bool = True) -> None:
    """Arguments for logs, robot and initial model."""
    with_log_only(parser, urdf_required)
    parser.add_argument(
        "--model",
        type=Input,
        default="rigid_body,viscous,coulomb",
        help="components of the model, separated by commas (default: %(default)s), or a model "
        "stored as *.skops",
    )
    parser.add_argument(
        "--nominal",
        action="store_true",
        help="keep the inertial parameters of the URDF instead of identifying them",
    )


def with_controller(parser: Any, text: str) -> None:
    """The controller that follows the commanded positions of a log."""
    parser.add_argument(
        "--controller",
        metavar="fit|JSON",
        help=f"{text}, through this controller: fit estimates it from the log (fit-shared: one "
        'gain for all joints), \'{"stiffness": 40, "damping": 2}\' states it (N m/rad, N m s/rad; '
        "null for no limit)",
    )


def with_report(parser: Any) -> None:
    """A report of skidyn diagnose, which contains the paths of the log and the model."""
    parser.add_argument(
        "--from", dest="report", type=Input, required=True, help="report.json of diagnose"
    )
    parser.add_argument(
        "--urdf",
        type=Input,
        help="description of the robot (default: that of the report, looked for in the report's "
        "folder, then here)",
    )


def with_joints(parser: Any, text: str) -> None:
    # not `joints`: that is the option of the log, which a report records
    parser.add_argument(
        "--joints", "--on", dest="on", metavar="1,4", help=f"{text}, counted from 1"
    )
