# SPDX-License-Identifier: BSD-3-Clause
"""Coverage of 95 % intervals and bands where the noise is anything but white.

    python benchmarks/identification/coverage.py [n_seeds]

Torque noise is autoregressive, coefficient 0.95 from sample to sample (100 Hz). Intervals of all
coefficients, rigid body and friction: from the usual formula of least squares, which takes samples
as independent; from the jackknife of ``coef_std_``; from the bootstrap over trajectories. Bands:
share of the measurements of new trajectories inside ``predict_interval``, all joints, and the joint
and recording with the least.
"""

from __future__ import annotations

import sys
import warnings

import numpy as np
import pandas as pd
from scipy.signal import lfilter
from scipy.stats import t as student_t

from skidyn.datasets import load_panda, load_planar_arm, load_ur10e
from skidyn.evidence import evidence_from_motion
from skidyn.identification import RBDRegressor, bootstrap_coefficients
from skidyn.robots import Robot, find_base_parameters

LOADS = {"planar arm": load_planar_arm, "UR10e": load_ur10e, "Panda": load_panda}
FRICTION = ("viscous", "coulomb")
TRAJECTORIES, NEW, SECONDS, RATE, COLOUR = 10, 4, 8.0, 100.0, 0.95
VISCOUS, DRY = 0.4, 0.6


def simulate(robot: Robot, rng: np.random.Generator) -> tuple[pd.DataFrame, np.ndarray, np.ndarray]:
    """A log of several trajectories, its torque and the true inertial parameters."""
    n = robot.n_joints
    truth = robot.inertial_parameters * rng.uniform(0.8, 1.2, (robot.n_bodies, 1))
    time = np.arange(int(SECONDS * RATE)) / RATE
    frames, torques = [], []
    for k in range(TRAJECTORIES + NEW):
        q, dq, ddq = np.zeros((3, len(time), n))
        for harmonic in range(1, 6):
            w = 2 * np.pi * 0.15 * harmonic
            size = rng.uniform(0.1, 0.4, n) / np.sqrt(harmonic)
            angle = w * time[:, None] + rng.uniform(0, 2 * np.pi, n)
            q += size * np.sin(angle)
            dq += w * size * np.cos(angle)
            ddq -= w**2 * size * np.sin(angle)
        clean = robot.inverse_dynamics(q, dq, ddq, parameters=truth)
        clean += VISCOUS * dq + DRY * np.tanh(dq / 0.003)
        white = rng.normal(0, 0.3 * np.sqrt(1 - COLOUR**2), (len(time) + 200, n))
        noise = lfilter([1.0], [1.0, -COLOUR], white, axis=0)[200:]
        signals = {
            f"{s}{j + 1}": x[:, j]
            for s, x in (("q", q), ("dq", dq), ("ddq", ddq))
            for j in range(n)
        }
        frames.append(pd.DataFrame({"time": time, "trajectory": k, **signals}))
        torques.append(clean + noise)
    return pd.concat(frames, ignore_index=True), np.vstack(torques), truth


def white_intervals(
    robot: Robot, frame: pd.DataFrame, torque: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Weighted least squares on all samples and its standard errors by the usual formula."""
    signals = [
        frame[[f"{s}{j + 1}" for j in range(robot.n_joints)]].to_numpy() for s in ("q", "dq", "ddq")
    ]
    evidence = evidence_from_motion(robot, *signals, torque, FRICTION)
    noise = evidence.noise(evidence.solve())
    rows = np.vstack([factor / noise[key[1]] for key, factor in evidence.factors.items()])
    inverse = np.linalg.inv(rows[:, :-1].T @ rows[:, :-1])
    value = inverse @ rows[:, :-1].T @ rows[:, -1]
    base = find_base_parameters(robot)
    value[: len(base.index)] += base.values(robot.inertial_parameters)
    return value, np.sqrt(np.diag(inverse))


def one(robot: Robot, seed: int) -> dict[str, np.ndarray]:
    """Whether the truth lies inside, for every coefficient and every new measurement."""
    rng = np.random.default_rng(seed)
    frame, torque, truth = simulate(robot, rng)
    known = (frame["trajectory"] < TRAJECTORIES).to_numpy()
    true = np.r_[
        find_base_parameters(robot).values(truth),
        np.full(robot.n_joints, VISCOUS),
        np.full(robot.n_joints, DRY),
    ]
    model = RBDRegressor(robot, FRICTION).fit(frame[known], torque[known])
    names = list(find_base_parameters(robot).expressions)
    names += [
        f"{kind}[{j + 1}]" for kind in ("viscous.Fv", "coulomb.Fc") for j in range(robot.n_joints)
    ]
    place = [names.index(name) for name in model.coef_names_]
    wide = student_t.ppf(0.975, TRAJECTORIES - 1)
    draws = bootstrap_coefficients(model, 1000, random_state=seed)
    value, white = white_intervals(robot, frame[known], torque[known])
    low, high = model.predict_interval(frame[~known])
    measured = torque[~known]
    return {
        "white": np.abs(value - true)[place] <= 1.96 * white[place],
        "jackknife": np.abs(model.coef_ - true[place]) <= wide * model.coef_std_,
        "bootstrap": np.abs(model.coef_ - true[place]) <= wide * draws.std(axis=0),
        "band": (low <= measured) & (measured <= high),
    }


def main() -> None:
    """Print the table."""
    n_seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    warnings.simplefilter("ignore")
    print(f"{n_seeds} logs of each robot, {TRAJECTORIES} trajectories of {SECONDS:.0f} s")
    print(
        f"{'':12s}{'coefficients inside their interval':^36s}{'measurements inside the band':>32s}"
    )
    print(
        f"{'robot':12s}{'white':>12s}{'jackknife':>12s}{'bootstrap':>12s}{'all':>12s}{'least':>12s}"
    )
    for name, load in LOADS.items():
        robot = load()
        found = [one(robot, seed) for seed in range(n_seeds)]
        shares = [
            np.mean([r[kind] for r in found])
            for kind in ("white", "jackknife", "bootstrap", "band")
        ]
        least = min(r["band"].mean(axis=0).min() for r in found)
        print(f"{name:12s}" + "".join(f"{s:12.1%}" for s in (*shares, least)), flush=True)


if __name__ == "__main__":
    main()
