# SPDX-License-Identifier: BSD-3-Clause
"""Placebo: real residuals against features of another recording, where no effect can exist.

    SKIDYN_DATA=FOLDER python benchmarks/diagnosis/placebo.py

The residual of each UR10e recording is tested against every single-column effect computed from the
motion of a different recording of the same length, at a nominal 5 % and with the Benjamini-Hochberg
correction: by the ordinary t-test on averaged rows, and by the rule of the diagnosis.
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np
from scipy.stats import norm

from skidyn._signals import read_signals
from skidyn.diagnosis._tester import Tester
from skidyn.effects import Term, get_effect, make_terms
from skidyn.evidence import make_problem
from skidyn.logs import load_recording
from skidyn.robots import Robot

GAINS = (14.87, 13.26, 11.13, 10.62, 11.03, 11.47)
BASE = ("viscous", "coulomb", "offset", "rotor_inertia")
KINDS = ("stribeck", "nonlinear_viscous", "load_dependent_friction", "dahl", "end_stop")
RUNS = (
    "ur-20_02_10-30sec_12harm",
    "ur-20_02_12-40sec_12harm",
    "ur-20_02_12-50sec_12harm",
    "ur-20_02_05-20sec_12harm",
    "ur-20_02_05-20sec_8harm",
    "ur-20_02_06-20sec_10harm",
)


def prepare(name: str, robot: Robot, folder: Path):
    """Problem of one recording with its base model fitted."""
    frame = load_recording(folder / "ur10e_excitation.npz", run=name, drive_gains=GAINS).frame
    signals, torque = read_signals(frame, frame[[f"tau{j + 1}" for j in range(6)]], robot)
    problem = make_problem(signals, torque, robot=robot, rigid_body=True, terms=make_terms(BASE, 6))
    fit = problem.fit(problem.terms, passes=3)
    problem.set_fit(fit)
    return problem, fit


def main() -> None:
    warnings.simplefilter("ignore")
    folder = Path(os.environ["SKIDYN_DATA"]) / "ur10e"
    robot = Robot.from_urdf(folder / "ur10e_min.urdf")
    problems = {name: prepare(name, robot, folder) for name in RUNS}
    ordinary, rule, kinds = [], [], []
    for here, (problem, fit) in problems.items():
        own = [problem.term_rows(term) for term in problem.terms]
        tester = Tester(problem, own, fit.noise, problem.target)
        for there, (other, _) in problems.items():
            if there == here:
                continue
            for joint in range(6):
                r = fit.residual[joint] / fit.residual[joint].std()
                for kind in KINDS:
                    for shape in get_effect(kind).grid(other.signals, (joint,))[:3]:
                        x = other.term_rows(Term.at(kind, (joint,), shape))[joint][:, 0]
                        n = min(len(r), len(x))
                        if n < 100 or x[:n].std() == 0:
                            continue
                        a = x[:n] - x[:n].mean()
                        z = float(a @ r[:n] / np.sqrt(a @ a))
                        ordinary.append(2 * norm.sf(abs(z)))
                        column = np.zeros((len(r), 1))
                        column[:n, 0] = a
                        rule.append(tester.test({joint: column}).chance)
                        kinds.append(kind)
    tests = {
        "t-test": ordinary,
        "rule of the diagnosis": rule,
    }
    for label, values in tests.items():
        p = np.array(values)
        flagged = float((p < 0.05).mean())
        order = np.sort(p)
        passed = np.flatnonzero(order <= 0.05 * np.arange(1, len(p) + 1) / len(p))
        discoveries = int(passed[-1] + 1) if len(passed) else 0
        print(f"{label:30s} {len(p)} tests, flagged at 5 %: {flagged:6.1%}, ", end="")
        print(f"discoveries after Benjamini-Hochberg: {discoveries}")
    for kind in KINDS:
        own = np.array(rule)[np.array(kinds) == kind]
        print(f"  {kind:28s} {len(own)} tests, flagged at 5 %: {(own < 0.05).mean():6.1%}")


if __name__ == "__main__":
    main()
