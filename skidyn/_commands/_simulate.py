# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn simulate``: simulate a fitted model along a log, or a log with a hidden effect."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import Input, Output, command, with_controller, with_joints
from skidyn._commands._input import embedded_robot, joint_numbers, read_driven, stored_model
from skidyn._commands._output import print_json, working, write_table
from skidyn._exceptions import SkidynError
from skidyn._text import joints_told

DESCRIPTION = """\
With --model and --log, simulate a fitted model along a log and print how far its motion deviates
from the logged one; the log should not be the one that the model was fitted to.

  skidyn simulate --model robot.skops --log run2.csv
  skidyn simulate --model robot.skops --log run2.csv --horizon 0.5 --engine mujoco
  skidyn simulate --model robot.skops --log run2.csv --controller fit

Without them, write a log of a simulated robot with a hidden effect, to test the diagnosis on a
known answer. The answer is printed and not written into the log.

  skidyn simulate --robot panda --effect dahl --joints 4 --out log.parquet
  skidyn simulate --robot scara --effect none --noise high --seed 3 --out log.csv
"""


def add_parser(commands: Any) -> None:
    parser = command(
        commands,
        "simulate",
        run,
        "simulate a model along a log, or write a log with a hidden effect",
        DESCRIPTION,
    )
    parser.add_argument("--robot", default="panda", help="embedded robot (default: %(default)s)")
    parser.add_argument(
        "--effect", default="dahl", help="kind of the effect, or none (default: %(default)s)"
    )
    with_joints(parser, "joints with the effect (default: a suitable choice)")
    parser.add_argument(
        "--noise",
        default="low",
        choices=("low", "high"),
        help="noise of the torques (default: %(default)s)",
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="seed of all random numbers (default: 0)"
    )
    parser.add_argument(
        "--out", type=Output, metavar="LOG", help="file.csv or file.parquet to write"
    )
    _with_log_to_follow(parser)


def _with_log_to_follow(parser: Any) -> None:
    along = parser.add_argument_group("along a log")
    along.add_argument(
        "--model",
        type=Input,
        metavar="SKOPS",
        help="fitted model, stored by skidyn.save_model or skidyn explore",
    )
    along.add_argument(
        "--log",
        dest="logs",
        nargs="+",
        type=Input,
        metavar="LOG",
        help="recordings, one or more files",
    )
    along.add_argument(
        "--horizon",
        type=float,
        default=1.0,
        metavar="S",
        help="seconds after which the simulation restarts from the logged state; 0 for whole "
        "trajectories (default: %(default)s)",
    )
    along.add_argument(
        "--engine",
        default="own",
        choices=("own", "mujoco"),
        help="simulator of the motion (default: %(default)s)",
    )
    with_controller(
        along, "drive the model by the commanded positions of the log instead of its torque"
    )
    along.add_argument("--columns", metavar="JSON", help="which columns hold which signals")
    along.add_argument("--units", metavar="JSON", help="units that are not SI")
    along.add_argument("--drive-gains", metavar="JSON", help="torque per ampere of each joint")
    along.add_argument("--rate", type=float, help="sampling rate in Hz of a log without time")


def run(options: argparse.Namespace) -> None:
    if (options.model is None) != (options.logs is None):
        lost = "--log" if options.logs is None else "--model"
        raise SkidynError(f"{lost} is missing: a simulation along a log needs --model and --log")
    if options.model is not None:
        _along(options)
    else:
        _hidden(options)


def _along(options: argparse.Namespace) -> None:
    """Simulate a fitted model along a log."""
    from skidyn.forward import robot_of
    from skidyn.simulation import simulate, simulation_errors

    if options.out is not None and Path(options.out).suffix not in (".csv", ".parquet"):
        raise SkidynError(f"{options.out}: the motion to write must end in .csv or .parquet")
    model = stored_model(options.model)
    robot = robot_of(model)
    frame, tau, controller = read_driven(options, robot)
    said: dict[str, Any] = {"horizon": options.horizon or None, "engine": options.engine}
    if controller is not None:
        tau, said["controller"] = None, controller
    with working("Simulating", options):
        found = simulation_errors(model, frame, tau, **said)
        if options.out is not None:
            motion = simulate(model, frame, tau, **said)
            write_table(motion, options.out)
    if options.json:
        print_json(found.to_dict())
        return
    print(found.text)
    if options.out is not None:
        print(f"simulated motion written: {Path(options.out).resolve()}")


def _hidden(options: argparse.Namespace) -> None:
    """Write a log with a hidden effect."""
    from skidyn.datasets import make_hidden_effect_log

    if options.out is None:
        raise SkidynError("--out is missing: the log to write, file.csv or file.parquet")
    if Path(options.out).suffix not in (".csv", ".parquet"):
        raise SkidynError(f"{options.out}: the log to write must end in .csv or .parquet")
    robot = embedded_robot(options.robot)
    effect = None if options.effect == "none" else options.effect
    with working("Simulating", options):
        log = make_hidden_effect_log(
            robot,
            effect,
            joints=joint_numbers(options.on),
            noise=options.noise,
            random_state=options.seed,
        )
    write_table(log.frame, options.out)
    truth = {"effect": log.effect, "joints": list(log.joints), "parameters": log.parameters}
    if options.json:
        print_json(truth)
    else:
        print(f"{len(log.frame)} samples written: {Path(options.out).resolve()}")
        print(f"hidden: {_told(log.effect, truth['joints'], log.parameters)}")


def _told(effect: str | None, joints: list[int], parameters: Mapping[str, Any]) -> str:
    """Description of the hidden effect."""
    if effect is None:
        return "nothing"
    lines = [f"{effect} on {joints_told(joints)}" if joints else effect]
    for name, value in parameters.items():
        numbers = value if isinstance(value, (list, tuple)) else [value]
        shown = (f"{x:.4g}" if isinstance(x, float) else str(x) for x in numbers)
        lines.append(f"  {name:14s}{', '.join(shown)}")
    return "\n".join(lines)
