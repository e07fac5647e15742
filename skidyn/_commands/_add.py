# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn add``: add an effect to a diagnosed model."""

from __future__ import annotations

import argparse
import json
import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from skidyn._commands._arguments import JsonFile, command, with_joints, with_report
from skidyn._commands._controllers import controller_told, driven_with
from skidyn._commands._earlier import earlier_checks
from skidyn._commands._input import (
    joint_numbers,
    read_effects,
    read_inputs,
    recorded_options,
    settings_of,
)
from skidyn._commands._output import parameters, print_json, run_diagnosis
from skidyn._exceptions import SkidynError
from skidyn._text import digits
from skidyn._writing import write_json

if TYPE_CHECKING:
    from skidyn.effects import Term

#: Growth of a held-out error from which a joint is marked as worse.
WORSE = 0.02

DESCRIPTION = """\
Add an effect to a model that skidyn diagnose has judged, and print the held-out error before and
after. The report records the files of the log and the model, and the recordings and times of
effects that act in some of them only.

  skidyn diagnose run*.csv --urdf robot.urdf --out report.json
  skidyn add --from report.json --effect dahl --joints 1,4 --out better.json

A setting of a servo (servo_gain, servo_current, servo_voltage, servo_deadband) that the report
contains is added to the controller, which is printed.
"""


def add_parser(commands: Any) -> None:
    parser = command(
        commands,
        "add",
        run,
        "add an effect to a diagnosed model and print the error before and after",
        DESCRIPTION,
    )
    with_report(parser)
    parser.add_argument("--effect", required=True, help="kind of effect in the catalogue")
    with_joints(parser, "joints that get the effect (default: all)")
    parser.add_argument(
        "--out", type=JsonFile, metavar="JSON", help="write the parameters of the better model"
    )


def limited_terms(path: str, kind: str, joints: Sequence[int] | None, n_joints: int) -> list[Term]:
    """Terms of a kind in a report that limits some of them to recordings or times.

    Empty if it limits none, or has none on some of the joints; the report may be untrusted.
    """
    from skidyn.effects import Term, get_effect

    every = tuple(range(1, n_joints + 1))

    def term(entry: Any) -> Term | None:
        on = tuple(map(int, entry["joints"]))
        if entry["kind"] != kind or not (joints is None or set(on) & set(joints)):
            return None
        acts = entry.get("acts") or {}
        when: dict[str, Any] = {}
        if acts.get("trajectories") is not None:
            when["trajectories"] = tuple(map(int, acts["trajectories"]))
        for name in ("spans", "course"):
            if acts.get(name):
                when[name] = tuple((int(k), *map(float, x)) for k, *x in acts[name])
        effect, stated = get_effect(kind), entry.get("form") or {}
        form = {name: stated[name] for name in effect.form_names & set(stated)}
        if not all(isinstance(value, int | float) for value in form.values()):
            raise ValueError("the form of an effect is given by numbers")
        return Term(kind, every if effect.scope == "robot" else on, form | when)

    terms = read_effects(path, term)
    covered = {joint for found in terms for joint in found.joints}
    limited = any(found.when for found in terms) and (joints is None or set(joints) <= covered)
    return terms if limited else []


def run(options: argparse.Namespace) -> None:
    from skidyn.effects import get_effect, make_terms

    kind, joints = options.effect, joint_numbers(options.on)
    options = recorded_options(options)
    # a diagnosis checks the log
    robot, model, frame, tau, controller = read_inputs(options, check=False)
    setting = get_effect(kind).of_servo
    known = [] if controller is None or "tau1" in frame else settings_of(options.report)
    added = [s for s in known if setting and s.is_of(kind, joints)]
    if setting and not added:
        raise SkidynError(
            f"{options.report} has no {kind} on these joints; it is a setting of the servo, which "
            "skidyn diagnose finds in a log without torque, or --controller states"
        )
    if controller is not None:  # other effects are judged by the torque with all settings
        others = [s for s in known if s not in added]
        controller, tau = driven_with(controller, tau, others, frame, robot.n_joints)
    checks = earlier_checks(options)
    given = run_diagnosis(model, frame, tau, options, kinds=(), checks=checks)
    stated = None
    if controller is not None and added:
        controller, tau = driven_with(controller, tau, added, frame, robot.n_joints)
        fitted = better = model.fit(frame, tau)
        stated = controller_told(controller, robot.n_joints)
    else:
        terms = limited_terms(options.report, kind, joints, robot.n_joints) or make_terms(
            [kind if joints is None else (kind, joints)], robot.n_joints
        )
        had = {(t.kind, t.joints) for t in make_terms(model.effects, robot.n_joints)}
        if not any(t.when for t in terms) and {(t.kind, t.joints) for t in terms} <= had:
            raise SkidynError(f"the model has {kind} on these joints already")
        fitted = model.with_effects(terms).fit(frame, tau)
        better = model.with_effects(fitted.effect_terms_[-len(terms) :])
    after = run_diagnosis(better, frame, tau, options, kinds=(), checks=given.checks).rmse_before
    before = given.rmse_before
    if options.out:
        write_json(options.out, parameters(fitted))
    if options.json:
        content: dict[str, Any] = {"before": before.tolist(), "after": after.tolist()}
        print_json(content if stated is None else {**content, "controller": json.loads(stated)})
        return
    print(f"held-out error on judged samples with {kind} added")
    for j, name in enumerate(robot.joint_names):
        change = round(after[j] / before[j] - 1, 2) if before[j] > 0 else 0.0
        unit = "N" if robot.joint_types[j] == "prismatic" else "N m"
        told = f"{digits(before[j]):>9s} -> {digits(after[j]):>9s} {unit}"
        mark = "  worse" if change >= WORSE else ""
        print(f"  {j + 1} {name:24s} {told}  ({change + 0.0:+.0%}){mark}")
    if options.out:
        print(f"written: {options.out}")
    if stated is not None:
        print(f"next: the same with --controller {shlex.quote(stated)}")
