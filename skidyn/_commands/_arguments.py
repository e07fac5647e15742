# SPDX-License-Identifier: BSD-3-Clause
"""Words that several commands share."""

from __future__ import annotations

from typing import Any

from skidyn._commands._terminal import TeachingFormatter


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
    """Logs, robot, and how the columns are to be read."""
    parser.add_argument("logs", nargs="+", metavar="LOG", help="recordings, one or more files")
    parser.add_argument(
        "--urdf", required=urdf_required, metavar="URDF", help="description of the robot"
    )
    with_reading(parser)


def with_reading(parser: Any) -> None:
    """How the columns of logs are to be read."""
    parser.add_argument(
        "--columns",
        metavar="JSON",
        help='which columns hold which signals: {"q": ["pos_a", "pos_b"], "tau": [...]}',
    )
    parser.add_argument("--units", metavar="JSON", help='units that are not SI: {"q": "deg"}')
    parser.add_argument(
        "--drive-gains", metavar="JSON", help="torque per ampere of each joint: logs of currents"
    )
    parser.add_argument("--joints", help="joints the log covers, separated by commas")
    parser.add_argument("--rate", type=float, help="sampling rate in Hz of a log without time")


def with_log(parser: Any, urdf_required: bool = True) -> None:
    """Logs, robot and the model to start from."""
    with_log_only(parser, urdf_required)
    parser.add_argument(
        "--model",
        default="rigid_body,viscous,coulomb",
        help="what the model has, separated by commas (default: %(default)s), or a model stored as "
        "*.skops",
    )
    parser.add_argument(
        "--nominal",
        action="store_true",
        help="keep the inertial parameters of the URDF instead of identifying them",
    )


def with_joints(parser: Any, text: str) -> None:
    # not `joints`: that is the option of the log, which a report records
    parser.add_argument(
        "--joints", "--on", dest="on", metavar="1,4", help=f"{text}, counted from 1"
    )
