# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn export``: a fitted model as C, Python, URDF or MJCF."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import command, with_log
from skidyn._commands._input import read_model_and_log
from skidyn._commands._output import print_json, working, write_json
from skidyn._exceptions import SkidynError

DESCRIPTION = """\
Fit a model to a log and write it for other tools.

  skidyn export run1.csv --urdf robot.urdf --c model.c --python model.py --to-urdf new.urdf

C and Python get a function of q, dq, ddq for feedforward, which needs no other package. What a
format cannot hold (a URDF knows viscous and Coulomb friction only) is listed, and written to
FILE.skidyn.json beside it.
"""


def add_parser(commands: Any) -> None:
    """Add the command to the parser."""
    parser = command(commands, "export", run, "write a fitted model for other tools", DESCRIPTION)
    with_log(parser)
    parser.add_argument("--consistent", action="store_true", help="only bodies that can exist")
    parser.add_argument("--c", metavar="FILE", help="C function to write")
    parser.add_argument("--python", metavar="FILE", help="Python module to write")
    parser.add_argument("--to-urdf", metavar="FILE", help="URDF to write")
    parser.add_argument("--to-mjcf", metavar="FILE", help="MJCF to write, for MuJoCo")


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from skidyn import export
    from skidyn.report._write import write_text

    wanted = (options.c, options.python, options.to_urdf, options.to_mjcf)
    if not any(wanted):
        raise SkidynError("nothing to write: give --c, --python, --to-urdf or --to-mjcf")
    model, frame, tau = read_model_and_log(options)
    model.set_params(consistent=options.consistent)
    with working("Identifying", options):
        model.fit(frame, tau)
    terms, rest = export.model_terms(model)
    left: dict[str, list[str]] = {}
    for path, source in ((options.c, export.c_source), (options.python, export.python_source)):
        if path:
            write_text(path, source(model.robot_, **terms))
            left[path] = sorted(rest)
    held = {k: v for k, v in terms.items() if k not in ("blur", "offset")}
    other = rest | ({"offset": terms["offset"]} if "offset" in terms else {})
    for path, write in ((options.to_urdf, export.write_urdf), (options.to_mjcf, export.write_mjcf)):
        if path:
            left[path] = list(write(model.robot_, path, **held, effects=other))
    for path in (options.c, options.python):
        if path and rest:
            write_json(f"{path}.skidyn.json", rest)
    if options.json:
        print_json({str(Path(path).resolve()): names for path, names in left.items()})
        return
    for path, names in left.items():
        print(f"written: {Path(path).resolve()}")
        if names:
            print(f"  not in it: {', '.join(names)}")
