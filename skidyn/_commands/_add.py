# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn add``: add an effect to a diagnosed model."""

from __future__ import annotations

import argparse
from typing import Any

from skidyn._commands._arguments import JsonFile, command, with_joints, with_report
from skidyn._commands._input import joint_numbers, read_model_and_log, read_robot, recorded_options
from skidyn._commands._output import parameters, print_json, run_diagnosis
from skidyn._text import digits
from skidyn._writing import write_json

DESCRIPTION = """\
Add an effect to a model that skidyn diagnose has judged, and print the held-out error before and
after. The report records the files of the log and the model.

  skidyn diagnose run*.csv --urdf robot.urdf --out report.json
  skidyn add --from report.json --effect dahl --joints 1,4 --out better.json
"""


def add_parser(commands: Any) -> None:
    parser = command(
        commands,
        "add",
        run,
        "add an effect to a diagnosed model and print the error before, after",
        DESCRIPTION,
    )
    with_report(parser)
    parser.add_argument("--effect", required=True, help="kind of effect in the catalogue")
    with_joints(parser, "joints that get the effect (default: all)")
    parser.add_argument(
        "--out", type=JsonFile, metavar="JSON", help="write the parameters of the better model"
    )


def run(options: argparse.Namespace) -> None:
    from skidyn.effects import make_terms

    options = recorded_options(options)
    model, frame, tau = read_model_and_log(options, check=False)  # a diagnosis checks it
    robot = read_robot(options)
    joints = joint_numbers(options.on)
    spec = options.effect if joints is None else (options.effect, joints)
    terms = make_terms([spec], robot.n_joints)
    given = run_diagnosis(model, frame, tau, options, kinds=())
    before = given.rmse_before
    fitted = model.with_effects(terms).fit(frame, tau)
    better = model.with_effects(fitted.effect_terms_[-len(terms) :])
    after = run_diagnosis(better, frame, tau, options, kinds=(), checks=given.checks).rmse_before
    if options.out:
        write_json(options.out, parameters(fitted))
    if options.json:
        print_json({"before": before.tolist(), "after": after.tolist()})
        return
    print(f"held-out error on judged samples with {options.effect} added")
    for j, name in enumerate(robot.joint_names):
        change = round(after[j] / before[j] - 1, 2) if before[j] > 0 else 0.0
        unit = "N" if robot.joint_types[j] == "prismatic" else "N m"
        told = f"{digits(before[j]):>9s} -> {digits(after[j]):>9s} {unit}"
        print(f"  {j + 1} {name:24s} {told}  ({change + 0.0:+.0%})")
