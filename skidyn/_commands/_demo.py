# SPDX-License-Identifier: BSD-3-Clause
"""``skidyn demo``: the whole loop on a simulated log."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from skidyn._commands._arguments import Page, command
from skidyn._commands._output import print_json, rmse_per_joint, working, write_page
from skidyn._text import digits, joints_told, measure

#: Speed in rad/s above which a joint moves.
MOVING = 0.05

DESCRIPTION = """\
Run the whole loop on a simulated Panda arm with two hidden effects: compare, see where the model
fails, identify the missing effects, add them, and evaluate the better model on two trajectories
that were put aside. At the end the hidden effects are told.

  skidyn demo --html demo.html
"""


def add_parser(commands: Any) -> None:
    parser = command(commands, "demo", run, "run the whole loop on a simulated log", DESCRIPTION)
    parser.add_argument("--html", type=Page, default="skidyn-demo.html", help="page to write")


def run(options: argparse.Namespace) -> None:
    from skidyn.datasets import load_demo_log
    from skidyn.diagnosis import diagnose
    from skidyn.identification import RBDRegressor

    say = (lambda *words: None) if options.json else print
    say("1. A Panda arm is simulated with two effects that no model below contains.")
    say("   Two of its trajectories are put aside and not used in any fit.")
    log = load_demo_log()
    aside = log.X["trajectory"] >= log.X["trajectory"].max() - 1
    X, y, X_new, y_new = log.X[~aside], log.y[~aside], log.X[aside], log.y[aside]
    model = RBDRegressor(log.robot)
    say("2. The model: rigid body, viscous and Coulomb friction. Where does it fail?")
    with working("Searching for what is missing", options):
        diagnosis = diagnose(model, X, y)
    story = diagnosis.story()
    for failure in diagnosis.failures[:3]:
        say(f"   {failure.sentence}")
    say("3. What is missing?")
    for finding in story["findings"]:
        size = f": {finding['size']}" if finding["size"] else ""
        say(f"   {finding['what']} on {finding['where']}{size}; {finding['sure']}")
    say("4. Added and fitted again; held-out error of the joints that were wrong:")
    for row in story["joints"]:
        if row["speaks"]:
            say(f"   {row['name']} (joint {row['joint']}): {row['text']}")
    say("   On the trajectories put aside, while these joints move:")
    moves = abs(X_new[[f"dq{j + 1}" for j in range(log.robot.n_joints)]].to_numpy()) > MOVING
    before = rmse_per_joint(model.fit(X, y), X_new, y_new, moves)
    after = rmse_per_joint(diagnosis.model, X_new, y_new, moves)
    for row in story["joints"]:
        if row["speaks"]:
            a, b = (digits(errors[row["joint"] - 1]) for errors in (before, after))
            say(f"   {row['name']} (joint {row['joint']}): {a} → {b} {row['unit']}")
    say("5. What was hidden:")
    for effect in log.truth:
        say(f"   {_told(effect)}")
    write_page(diagnosis, options.html, {"log": "simulated by skidyn demo"})
    page = str(Path(options.html).resolve())
    if options.json:
        kinds = [finding.kind for finding in diagnosis.findings]
        print_json({"found": kinds, "before": before, "after": after, "html": page})
    say(f"6. The report: {page}")


def _told(effect: dict[str, Any]) -> str:
    """A hidden effect with its joints, and its parameters as far as the catalogue has them."""
    from skidyn.effects import get_effect

    kind = get_effect(effect["kind"])
    units = kind.units()
    sizes = (
        measure(name, value, units[name])
        for name, values in effect["parameters"].items()
        if name in units
        for value in values
    )
    return f"{kind.title} on {joints_told(effect['joints'])}: {', '.join(sizes)}"
