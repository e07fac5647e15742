# SPDX-License-Identifier: BSD-3-Clause
"""Unknown torques of random forms of one to three signals: joint and signals must be named.

    python benchmarks/diagnosis/unknown_torques.py [--logs 60] [--first 0] [--jobs 2] [--short]

Robots, noise, motion, joint, signals and form change from log to log. A torque is four times the
noise of its joint or a tenth of its torque, whichever is larger. It is right if the first finding
is an unknown torque of this joint with exactly its signals; named, if a known effect comes first.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from nothing_hidden import ROBOTS

from skidyn.datasets import make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

#: Functions of signals in units of half of their range, m and n are random places in it. A known
#: effect has none of these forms on the joints whose signals they take.
FORMS: dict[str, Callable[..., np.ndarray]] = {
    "bump": lambda x, m, n: np.exp(-(((x - m) / 0.25) ** 2)),
    "step": lambda x, m, n: np.sign(x - m),
    "wave": lambda x, m, n: np.cos(4 * x + 3 * n),
    "product of two": lambda x, y, m, n: x * y,
    "sign times size": lambda x, y, m, n: np.sign(x) * (np.abs(y) - 0.4),
    "bump times sign": lambda x, y, m, n: np.exp(-(((x - m) / 0.35) ** 2)) * np.sign(y),
    "quadrants": lambda x, y, m, n: np.tanh((x - m) / 0.1) * np.tanh((y - n) / 0.1),
    "wave over two": lambda x, y, m, n: np.cos(2.5 * x + 2 * y + m),
    "one side times another": lambda x, y, m, n: np.maximum(x - m, 0) * y,
    "product of three": lambda x, y, z, m, n: x * y * z,
    "sign times bump times another": lambda x, y, z, m, n: (
        np.sign(x) * np.exp(-(((y - m) / 0.5) ** 2)) * (z + 0.5)
    ),
    "step times wave": lambda x, y, z, m, n: np.tanh((x - m) / 0.2) * np.cos(2 * y + z),
}


def scaled(x: pd.Series) -> np.ndarray:
    """A signal in units of half of the range between its percentiles, from the middle."""
    low, high = np.percentile(x, [1, 99])
    return np.asarray((x - (low + high) / 2) / max((high - low) / 2, 1e-12))


def asked(seed: int, short: bool) -> tuple[str, str, str]:
    """Form, description and outcome of one log."""
    warnings.simplefilter("ignore")
    rng = np.random.default_rng([seed, 34])
    robot = ROBOTS[seed % len(ROBOTS)]()
    length = {"n_trajectories": 6, "duration": 5.0} if short else {}
    noise = ("low", "high")[seed // len(ROBOTS) % 2]
    log = make_hidden_effect_log(robot, None, noise=noise, random_state=5000 + seed, **length)
    form = list(FORMS)[int(rng.integers(len(FORMS)))]
    n_signals = FORMS[form].__code__.co_argcount - 2
    joint = int(rng.integers(robot.n_joints))
    # of other joints, so that no known effect of the joint itself has this form
    others = [k for k in range(robot.n_joints) if k != joint]
    names = [f"{kind}{k + 1}" for k in others for kind in ("q", "dq", "ddq")]
    signals = sorted(rng.choice(names, n_signals, replace=False).tolist())
    torque = FORMS[form](*(scaled(log.X[name]) for name in signals), *rng.uniform(-0.4, 0.4, 2))
    torque -= torque.mean()
    y = np.array(log.y, dtype=float)
    own = RBDRegressor(robot, ("viscous", "coulomb")).fit(log.X, y)
    noise_of_joint = np.std(y[:, joint] - own.predict(log.X)[:, joint])
    size = max(4 * noise_of_joint, 0.1 * np.std(y[:, joint]))
    y[:, joint] += size * torque / torque.std()
    findings = diagnose(RBDRegressor(robot, ("viscous", "coulomb")), log.X, y).findings
    what = (
        f"{robot.name}, {noise} noise, seed {seed}: {form} of {', '.join(signals)} on {joint + 1}"
    )
    if not findings:
        return form, what, "nothing"
    first = findings[0]
    if first.kind != "unknown":
        return form, f"{what}: {first.sentence}", "named"
    right = first.joints == (joint + 1,) and set(first.variables) == set(signals)
    return (
        form,
        f"{what}: {first.joints}, {', '.join(first.variables)}",
        "right" if right else "other",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=60)
    parser.add_argument("--first", type=int, default=0, help="seed of the first log")
    parser.add_argument("--short", action="store_true", help="six recordings of five seconds")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    results = Parallel(n_jobs=options.jobs)(
        delayed(asked)(options.first + k, options.short) for k in range(options.logs)
    )
    for _, what, outcome in results:
        if outcome != "right":
            print(f"{outcome}: {what}")
    for form in FORMS:
        own = [outcome for other, _, outcome in results if other == form]
        print(f"{form}: {own.count('right')} of {len(own)}")
    outcomes = [outcome for *_, outcome in results]
    for outcome in ("right", "other", "named", "nothing"):
        print(f"{outcome}: {outcomes.count(outcome)} of {len(outcomes)}")


if __name__ == "__main__":
    main()
