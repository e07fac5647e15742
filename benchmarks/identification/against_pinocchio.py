# SPDX-License-Identifier: BSD-3-Clause
"""Identification from arrays, compared with pinocchio and figaroh: differences and times.

    python benchmarks/identification/against_pinocchio.py [n_samples]

Needs pinocchio (``pip install pin``); figaroh (``pip install figaroh``) for the comparison with it.
Both sides are run alternately in one process on one thread; ratios of the best CPU times of 3
rounds, on the same columns: the rigid body, and for figaroh's regressor also with its four
additional columns of every joint (viscous, dry friction, rotor inertia, offset).
"""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from _common import ROBOTS, Oracle, interleaved, noisy_torque, random_motion

from skidyn.evidence import evidence_from_motion
from skidyn.identification import RBDRegressor, is_consistent, regressor_from_evidence
from skidyn.robots import find_base_parameters

try:
    from figaroh.tools.regressor import build_regressor_basic
    from figaroh.tools.solver import LinearSolver
except ImportError:
    build_regressor_basic = None


class Figaroh:
    """figaroh's regressor: one array of all samples, joint by joint."""

    def __init__(self, oracle: Oracle) -> None:
        self.robot = SimpleNamespace(model=oracle.model, data=oracle.data)
        self.settings = {"act_idxv": list(range(oracle.model.nv)), "is_joint_torques": True}

    def regressor(self, *motion: np.ndarray, beside: bool = False) -> np.ndarray:
        """Columns of the rigid body, and those beside it."""
        more = dict.fromkeys(("has_friction", "has_actuator_inertia", "has_joint_offset"), beside)
        return build_regressor_basic(self.robot, *motion, self.settings | more)


def agreement(name: str, oracle: Oracle, n_samples: int) -> str:
    """Largest difference of the base parameters, relative to the largest."""
    robot = oracle.robot
    motion = random_motion(robot, n_samples)
    torque = noisy_torque(robot, motion)
    base = find_base_parameters(robot)
    evidence = evidence_from_motion(robot, *motion, torque, ())
    found = evidence.solve() + base.values(robot.inertial_parameters)
    given, (measured,) = oracle.in_order(*motion), oracle.in_order(torque)
    columns = oracle.columns[base.index]
    rows = oracle.regressor(*given)[:, :, columns].reshape(-1, len(columns))
    expected = np.linalg.lstsq(rows, measured.ravel())[0]
    shown = f"{np.abs(found - expected).max() / np.abs(expected).max():10.1e}"
    if build_regressor_basic is None:
        return f"{name:18s}{len(columns):6d}{shown}         -"
    rows = Figaroh(oracle).regressor(*given)[:, columns]
    theirs = LinearSolver(method="lstsq", verbose=False).solve(rows, measured.T.ravel())
    return (
        f"{name:18s}{len(columns):6d}{shown}"
        f"{np.abs(found - theirs).max() / np.abs(theirs).max():10.1e}"
    )


def times(oracle: Oracle, n_samples: int) -> dict[str, float]:
    """Best CPU time per sample of everything, microseconds."""
    robot = oracle.robot
    motion = random_motion(robot, n_samples)
    torque = noisy_torque(robot, motion)
    base = find_base_parameters(robot)
    columns = oracle.columns[base.index]
    given, (measured,) = oracle.in_order(*motion), oracle.in_order(torque)
    model, data = oracle.model, oracle.data

    def blocks():
        """Rows [Y | tau] of all columns, block by block: samples, joints, columns."""
        block = np.empty((2048, model.nv, 10 * model.nv + 1))
        for start in range(0, n_samples, 2048):
            size = min(2048, n_samples - start)
            for k in range(size):
                block[k, :, :-1] = pin.computeJointTorqueRegressor(
                    model, data, given[0, start + k], given[1, start + k], given[2, start + k]
                )
            block[:size, :, -1] = measured[start : start + size]
            yield slice(start, start + size), block[:size]

    def pinocchio_gram() -> None:
        wanted = np.append(columns, 10 * model.nv)
        grams = np.zeros((model.nv, len(wanted), len(wanted)))
        for _, block in blocks():
            part = block[:, :, wanted]
            for j in range(model.nv):
                own = np.ascontiguousarray(part[:, j])
                grams[j] += own.T @ own

    def pinocchio_lstsq() -> None:
        rows = np.empty((n_samples, model.nv, len(columns)))
        for where, block in blocks():
            rows[where] = block[:, :, columns]
        np.linalg.lstsq(rows.reshape(-1, len(columns)), measured.ravel())

    def ours() -> None:
        evidence = evidence_from_motion(robot, *motion, torque, ())
        fitted = regressor_from_evidence(robot, evidence, (), consistent=True)
        assert is_consistent(fitted.inertial_parameters_)

    samples = np.hstack(list(motion))

    def estimator() -> None:
        fitted = RBDRegressor(robot, (), consistent=True).fit(samples, torque)
        assert is_consistent(fitted.inertial_parameters_)

    def chunks() -> None:
        for _ in robot.iter_torque_regressor(*motion):
            pass

    def chunks_and_more() -> None:
        beside = np.empty((4, robot.n_joints, 4096))
        for rows, _ in robot.iter_torque_regressor(*motion):
            size = rows.stop - rows.start
            beside[0, :, :size], beside[2, :, :size] = motion[1, rows].T, motion[2, rows].T
            np.sign(beside[0], out=beside[1])
            beside[3] = 1.0

    functions = {
        "consistent": ours,
        "estimator": estimator,
        "pin lstsq": pinocchio_lstsq,
        "evidence": lambda: evidence_from_motion(robot, *motion, torque, (), method="gram"),
        "evidence qr": lambda: evidence_from_motion(robot, *motion, torque, (), method="qr"),
        "pin gram": pinocchio_gram,
        "regressor": chunks,
        "with friction": chunks_and_more,
    }
    found = interleaved(functions, n_samples, rounds=3)
    if build_regressor_basic is not None:
        few = min(n_samples, 50_000)  # one array of all samples
        other = Figaroh(oracle)
        theirs = {
            "figaroh": lambda: other.regressor(*given[:, :few]),
            "figaroh, friction": lambda: other.regressor(*given[:, :few], beside=True),
        }
        found |= interleaved(theirs, few, rounds=2)
    return found


def main() -> None:
    """Print the tables."""
    n_samples = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    oracles = {name: Oracle(text()) for name, text in ROBOTS.items()}
    print("base parameters of 5,000 samples: largest difference / largest parameter")
    print(f"{'robot':18s}{'number':>6s}{'pinocchio':>10s}{'figaroh':>10s}")
    for name, oracle in oracles.items():
        print(agreement(name, oracle, 5_000), flush=True)
    print(f"\n{n_samples:,} samples, CPU microseconds per sample")
    print(f"{'':18s}{'to consistent parameters':^45s} |{'evidence of every joint':^36s}")
    print(
        f"{'robot':18s}{'pin':>9s}{'evidence':>9s}{'ratio':>9s}{'fit':>9s}{'ratio':>9s} |"
        f"{'pin':>9s}{'Gram':>9s}{'QR':>9s}{'ratio':>9s}"
    )
    measured = {}
    for name, oracle in oracles.items():
        t = measured[name] = times(oracle, n_samples)
        print(
            f"{name:18s}{t['pin lstsq']:9.2f}{t['consistent']:9.2f}"
            f"{t['pin lstsq'] / t['consistent']:9.1f}{t['estimator']:9.2f}"
            f"{t['pin lstsq'] / t['estimator']:9.1f} |{t['pin gram']:9.2f}{t['evidence']:9.2f}"
            f"{t['evidence qr']:9.2f}{t['pin gram'] / t['evidence']:9.1f}",
            flush=True,
        )
    if build_regressor_basic is not None:
        print(f"{'':18s}{'rigid-body columns':>27s} |{'and friction':>27s}")
        print(
            f"{'robot':18s}"
            + " |".join(f"{'figaroh':>9s}{'skidyn':>9s}{'ratio':>9s}" for _ in "12")
        )
        for name, t in measured.items():
            pairs = (("figaroh", "regressor"), ("figaroh, friction", "with friction"))
            cells = [f"{t[a]:9.2f}{t[b]:9.2f}{t[a] / t[b]:9.1f}" for a, b in pairs]
            print(f"{name:18s}" + " |".join(cells))
    print("targets: ratios of 8, 4 and 20; differences of 1e-8")


if __name__ == "__main__":
    main()
