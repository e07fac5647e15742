# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn export``: a fitted model as code, or as a description for other tools."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import Input, Output, command, with_controller, with_log
from skidyn._commands._input import json_option, read_inputs
from skidyn._commands._output import print_json, working
from skidyn._exceptions import SkidynError
from skidyn._writing import writable

DESCRIPTION = """\
Fit a model to a log and write it for other tools.

  skidyn export run1.csv --urdf robot.urdf --format c --out model.c
  skidyn export run1.csv --urdf robot.urdf --format urdf,mjcf --consistent --out identified

With --into, the numbers are written into a copy of your own MJCF or URDF, whose other bytes are
unchanged, or into a text layer over your own USD stage:

  skidyn export run1.csv --urdf robot.urdf --format mjcf --into own.xml --consistent --out new.xml

The ros2 format writes a ROS 2 package with a plugin of inverse_dynamics_solver to a new folder with
the name of the package; the bam format writes the friction of one joint to a BAM file for the given
servo:

  skidyn export run1.csv --urdf robot.urdf --format ros2 --out robot_dynamics
  skidyn export run1.csv --urdf robot.urdf --format bam --servo elbow --actuator xl330 --out m1.json

C, Python and ONNX files contain a function of q, dq, ddq for feedforward, which does not need
skidyn. With several formats, each file has the name of --out with its own suffix. Effects that a
format cannot represent (a URDF supports viscous and Coulomb friction only) are listed and written
to FILE.skidyn.json beside it.
"""

#: Suffix of the files of every format.
SUFFIXES = {
    "c": ".c",
    "python": ".py",
    "onnx": ".onnx",
    "urdf": ".urdf",
    "mjcf": ".xml",
    "usd": ".usda",
    "bam": ".json",
    "ros2": "",
}
#: Formats that go into a file of the user's own.
INTO = ("urdf", "mjcf", "usd")


def add_parser(commands: Any) -> None:
    parser = command(commands, "export", run, "write a fitted model for other tools", DESCRIPTION)
    with_log(parser)
    parser.add_argument(
        "--format",
        required=True,
        metavar="FORMAT",
        help=f"{', '.join(SUFFIXES)}; several separated by commas",
    )
    parser.add_argument("--out", type=Output, required=True, metavar="FILE", help="file to write")
    parser.add_argument(
        "--into",
        type=Input,
        metavar="FILE",
        help="your own MJCF or URDF, which is copied to --out; or your own USD stage, over which "
        "--out is a layer",
    )
    parser.add_argument("--servo", metavar="JOINT", help="joint of the servo, for bam")
    parser.add_argument("--actuator", help="name of the servo in BAM, such as xl330, for bam")
    parser.add_argument(
        "--motor", metavar="JSON", help='constants of the servo, for bam: \'{"kt": 0.4, "R": 3}\''
    )
    parser.add_argument(
        "--consistent", action="store_true", help="restrict bodies to physically consistent ones"
    )
    with_controller(
        parser, "compute the torque of a log without torque from the commands of its servos"
    )


def run(options: argparse.Namespace) -> None:
    from skidyn import export

    files = _files(options.format, options.out)
    if options.into is not None and (len(files) > 1 or not set(files) <= set(INTO)):
        raise SkidynError(f"--into takes --format {' or '.join(INTO)}, not {options.format}")
    if options.into is None and "usd" in files:
        raise SkidynError("--into is missing: the USD stage over which --format usd writes a layer")
    motor = json_option("motor", options.motor)
    for form, path in files.items():
        if form != "ros2":
            writable(path)
    _, model, frame, tau, _ = read_inputs(options)
    model.set_params(consistent=options.consistent)
    with working("Identifying", options):
        model.fit(frame, tau)
    left, failed = {}, []
    for form, path in files.items():
        try:
            if options.into is not None:
                effects = getattr(export, f"merge_{form}")(model, options.into, path)
            elif form == "bam":
                words = {"joint": options.servo, "actuator": options.actuator, "motor": motor}
                effects = export.write_bam(model, path, **words)
            elif form == "ros2":
                effects = export.write_ros2(model, path, package=path.name)
            else:
                effects = getattr(export, f"write_{form}")(model, path)
        except (SkidynError, OSError, ImportError) as error:
            failed.append(f"{form}: {error}")
        else:
            left[str(path.resolve())] = effects
    if options.json:
        print_json(left)
    else:
        for name, effects in left.items():
            print(f"written: {name}")
            if effects:
                print(f"  left out, and listed in {name}.skidyn.json: {', '.join(effects)}")
    if failed:
        raise SkidynError("not written: " + "; ".join(failed))


def _files(formats: str, out: str) -> dict[str, Path]:
    """File of every format."""
    wanted = [word.strip() for word in formats.split(",") if word.strip()]
    unknown = [word for word in wanted if word not in SUFFIXES]
    if unknown or not wanted:
        what = repr(unknown[0]) if unknown else "empty"
        raise SkidynError(f"--format is {what}; expected some of {', '.join(SUFFIXES)}")
    path = Path(out)
    if len(wanted) == 1:
        return {wanted[0]: path}
    stem = path.with_suffix("") if path.suffix in SUFFIXES.values() else path
    return {word: stem.with_name(stem.name + SUFFIXES[word]) for word in wanted}
