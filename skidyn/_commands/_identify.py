# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn identify``: identify parameters."""

from __future__ import annotations

import argparse
from typing import Any

from skidyn._commands._arguments import JsonFile, command, with_controller, with_log
from skidyn._commands._input import find_suspicions, read_inputs
from skidyn._commands._output import parameters, print_json, print_suspicions, working
from skidyn._writing import write_json

#: Estimators that need only a log.
ESTIMATORS = ("weighted", "ordinary", "robust", "ridge", "entropic", "output_error")
DESCRIPTION = """\
Identify inertial parameters and effects together and print them with standard errors that are valid
for autocorrelated residuals. Single masses can rarely be identified: the command prints the
identifiable combinations, how well the motion excites them, and which ones the data does not
determine.

  skidyn identify run*.csv --urdf robot.urdf --out parameters.json
  skidyn identify run*.csv --urdf robot.urdf --consistent     only physically possible bodies
  skidyn identify run*.csv --urdf robot.urdf --estimator robust

output_error finds the parameters whose simulated motion is nearest to the logged one. A log of
position servos needs their commands (cmd1.. or q_ref1..) instead of torque:

  skidyn identify servos.csv --urdf robot.urdf --nominal --controller fit \\
      --model rigid_body,viscous,coulomb,rotor_inertia --estimator output_error
"""


def add_parser(commands: Any) -> None:
    parser = command(commands, "identify", run, "identify parameters and print them", DESCRIPTION)
    with_log(parser)
    parser.add_argument("--out", type=JsonFile, metavar="JSON", help="write the parameters as JSON")
    parser.add_argument(
        "--consistent", action="store_true", help="restrict bodies to physically consistent ones"
    )
    parser.add_argument(
        "--estimator",
        default="weighted",
        choices=ESTIMATORS,
        help="estimator of the coefficients (default: %(default)s)",
    )
    parser.add_argument(
        "--prior-std",
        type=float,
        metavar="SHARE",
        help="relative uncertainty of the bodies of the URDF, for ridge and entropic; by default "
        "the value that predicts best",
    )
    parser.add_argument(
        "--essential",
        action="store_true",
        help="print only the parameters that the data determines well",
    )
    with_controller(
        parser, "compute the torque of a log without torque from the commands of its servos"
    )


def run(options: argparse.Namespace) -> None:
    robot, model, frame, tau, controller = read_inputs(options, check=False)
    checks = find_suspicions(frame, robot, options)
    model.set_params(
        consistent=options.consistent, estimator=options.estimator, prior_std=options.prior_std
    )
    driven: dict[str, Any] = {}
    if controller is not None and options.estimator == "output_error":
        # pieces would start from velocities that are differences of positions
        model.set_params(horizon=None)
        driven["controller"] = controller
    with working("Identifying", options):
        model.fit(frame, tau, **driven)
    content = {**parameters(model), "checks": [check.to_dict() for check in checks]}
    if options.out:
        write_json(options.out, content)
    if options.json:
        print_json(content)
        return
    print_suspicions(checks)
    essential = content["essential_parameters"]
    for row in essential["parameters"] if options.essential else content["coefficients"]:
        print(f"{row['value']:12.5g} ± {row['std']:9.2g}   {row['name']}")
    if options.essential:
        print(
            f"{len(essential['eliminated'])} other parameters are left out, which increases the "
            f"error by {100 * (essential['error_ratio'] - 1):.2g} %"
        )
    print(f"condition number of the excitation: {model.condition_number_:.3g}")
    for combination in content["open_combinations"]:
        print(f"  {combination['sentence']}")
