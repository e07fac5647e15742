# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn simulate``: write a log that hides an effect."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import command, with_joints
from skidyn._commands._input import embedded_robot, joint_numbers
from skidyn._commands._output import print_json, working, write_table
from skidyn._exceptions import SkidynError

DESCRIPTION = """\
Write a log of a simulated robot that hides an effect, to try the diagnosis on something whose
answer is known. The answer is printed, and not written into the log.

  skidyn simulate --robot panda --effect dahl --joints 4 --out log.parquet
  skidyn simulate --robot scara --effect none --noise high --seed 3 --out log.csv
"""


def add_parser(commands: Any) -> None:
    parser = command(commands, "simulate", run, "write a log that hides an effect", DESCRIPTION)
    parser.add_argument("--robot", default="panda", help="embedded robot (default: %(default)s)")
    parser.add_argument("--effect", default="dahl", help="kind, or none (default: %(default)s)")
    with_joints(parser, "joints that have the effect (default: a suitable choice)")
    parser.add_argument(
        "--noise", default="low", choices=("low", "high"), help="of torques (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of what is random (default: 0)")
    parser.add_argument("--out", required=True, metavar="LOG", help="file.csv or file.parquet")


def run(options: argparse.Namespace) -> None:
    from skidyn.datasets import make_hidden_effect_log

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
    """What the log hides, in words."""
    if effect is None:
        return "nothing"
    where = f" on joint{'s' if len(joints) > 1 else ''} {', '.join(map(str, joints))}"
    lines = [f"{effect}{where if joints else ''}"]
    for name, value in parameters.items():
        numbers = value if isinstance(value, (list, tuple)) else [value]
        shown = (f"{x:.4g}" if isinstance(x, float) else str(x) for x in numbers)
        lines.append(f"  {name:14s}{', '.join(shown)}")
    return "\n".join(lines)
