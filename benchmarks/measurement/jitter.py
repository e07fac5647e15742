# SPDX-License-Identifier: BSD-3-Clause
"""Influence of jittering time stamps on logs without a hidden effect, with and without the remedy.

Usage: python benchmarks/measurement/jitter.py [--diagnose]

Three robots and six clocks each: stamps that are off by up to 0.1, 0.3 and 1 ms, evenly and
normally, and seconds in single precision. It prints the suspicions, and held-out errors with the
recorded and the fixed stamps relative to those with the true clock; ``--diagnose`` also prints the
findings of a diagnosis of the log, fixed if this is suggested.
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np
import pandas as pd

from skidyn.datasets import load_planar_arm, load_scara, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.logs import check_log
from skidyn.measurement import regular_clock
from skidyn.robots import Robot


def clocks(time: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
    n = len(time)
    even = {f"{1e3 * s:g} ms": time + rng.uniform(-s, s, n) for s in (1e-4, 3e-4, 1e-3)}
    return even | {
        "normal .3 ms": time + np.clip(rng.normal(0, 3e-4, n), -1.5e-3, 1.5e-3),
        "float32 at 2e3 s": np.float32(time + 2e3).astype(float),
        "float32 at 1e4 s": np.float32(time + 1e4).astype(float),
    }


def held_out(frame: pd.DataFrame, robot: Robot) -> float:
    """Error on motion the fit did not see, over the spread of the torque."""
    names = [f"tau{k + 1}" for k in range(robot.n_joints)]
    train = (frame["trajectory"] % 2 == 1).to_numpy()
    tau = frame[names].to_numpy()
    model = RBDRegressor(robot, ("viscous", "coulomb")).fit(frame[train], tau[train])
    rest = tau[~train] - model.predict(frame[~train])
    return float(np.sqrt(np.mean((rest / tau.std(axis=0)) ** 2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--diagnose", action="store_true", help="slow")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    for i, load in enumerate((load_planar_arm, load_scara, load_ur5)):
        log = make_hidden_effect_log(
            load(), None, n_trajectories=8, duration=8.0, random_state=40 + i
        )
        plain = held_out(log.frame, log.robot)
        number = log.frame["trajectory"].to_numpy()
        rng = np.random.default_rng(i)
        for name, time in clocks(log.frame["time"].to_numpy(), rng).items():
            jittering = log.frame.assign(time=time)
            told = [c for c in check_log(jittering, log.robot).checks if c.certainty != "noted"]
            fixed = log.frame.assign(time=regular_clock(time, number))
            used = fixed if any(c.check == "clock_jitter" for c in told) else jittering
            ratios = [held_out(frame, log.robot) / plain for frame in (jittering, fixed)]
            words = [f"{c.check} {c.certainty}" for c in told]
            print(
                f"{log.robot.name:12s} {name:17s} {ratios[0]:6.3f} {ratios[1]:6.3f} {words}", end=""
            )
            if options.diagnose:
                tau = used[[f"tau{k + 1}" for k in range(log.robot.n_joints)]].to_numpy()
                model = RBDRegressor(log.robot, ("viscous", "coulomb"))
                result = diagnose(model, used, tau, force=True)
                print("", result.verdict, [f.kind for f in result.findings], end="")
            print(flush=True)


if __name__ == "__main__":
    main()
