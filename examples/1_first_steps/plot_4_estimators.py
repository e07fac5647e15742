# SPDX-License-Identifier: BSD-3-Clause
"""
Which estimator for which log
=============================

Weighted least squares is a good start, but not sufficient for three kinds of logs: those with
broken rows, those with too little excitation, and those with noisy motion. Here all three are
simulated with a known arm, and each is fitted with the estimator intended for it.
"""

# %%
# The bodies of the arm differ from the URDF by up to 20 %, and its joints have friction.
import os

import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_planar_arm
from skidyn.identification import RBDRegressor

robot = load_planar_arm()
truth = robot.inertial_parameters * np.array([[1.2], [0.85]])
n_seeds = 2 if os.environ.get("SKIDYN_SMALL") else 8


def torque(X):
    """Noise-free torque of rows [q, dq, ddq]."""
    rigid = robot.inverse_dynamics(X[:, :2], X[:, 2:4], X[:, 4:], parameters=truth)
    return rigid + 0.3 * X[:, 2:4]


new = np.random.default_rng(99).uniform(-2, 2, (300, 6))


def error(estimator, X, y, **others):
    """Error on new motion, relative to its torque."""
    model = RBDRegressor(robot, ("viscous",), estimator=estimator).fit(X, y, **others)
    return np.linalg.norm(model.predict(new) - torque(new)) / np.linalg.norm(torque(new))


def broken(share, rng):
    """Log of which a share of the rows is off by 20 N m."""
    X = rng.uniform(-2, 2, (400, 6))
    y = torque(X) + rng.normal(0, 0.2, (400, 2))
    y[rng.random(400) < share] += 20.0
    return X, y, {}


def short(n_samples, rng):
    """Few samples of slow motion with much noise."""
    X = rng.uniform(-0.5, 0.5, (n_samples, 6))
    return X, torque(X) + rng.normal(0, 0.5, (n_samples, 2)), {}


def noisy(noise, rng):
    """Log whose velocities and accelerations are noisy, and the reference motion."""
    reference = rng.uniform(-2, 2, (400, 6))
    X = reference + rng.normal(0, noise, reference.shape) * [0, 0, 1, 1, 1, 1]
    return X, torque(reference) + rng.normal(0, 0.2, (400, 2)), reference


# %%
# The errors are medians over random logs of each kind.
cases = (
    (broken, (0.0, 0.05, 0.1, 0.15, 0.2), ("weighted", "robust"), "share of broken rows"),
    (short, (20, 40, 80, 160, 320), ("weighted", "ridge", "entropic"), "samples"),
    (
        noisy,
        (0.0, 0.2, 0.4, 0.6, 0.8),
        ("weighted", "instrumental"),
        "noise of velocity and acceleration",
    ),
)
figure, axes = plt.subplots(1, 3, figsize=(11, 3.5), layout="constrained")
for axis, (make, values, estimators, label) in zip(axes, cases, strict=True):
    for name in estimators:
        medians = []
        for value in values:
            errors = []
            for seed in range(n_seeds):
                X, y, reference = make(value, np.random.default_rng(seed))
                others = {"instruments": reference} if name == "instrumental" else {}
                errors.append(error(name, X, y, **others))
            medians.append(float(np.median(errors)))
        print(f"{label}, {name}: {', '.join(f'{m:.1%}' for m in medians)}")
        axis.plot(values, medians, "o-", label=name)
    axis.set(xlabel=label, yscale="log", ylim=(1e-3, None))
    axis.legend()
axes[0].set_ylabel("relative error on new motion")
axes[1].set_xscale("log")
axes[1].set_xticks(cases[1][1], [str(value) for value in cases[1][1]], minor=False)
axes[1].minorticks_off()

# %%
# The log itself shows whether instruments are needed. With noise of 0.4, the error of least squares
# is significant for the coefficients with small p-values:
X, y, reference = noisy(0.4, np.random.default_rng(0))
model = RBDRegressor(robot, ("viscous",), estimator="instrumental")
model.fit(X, y, instruments=reference)
for row in model.durbin_wu_hausman():
    print(
        f"{row['name']:28s} {row['difference']:+.3f} ± {row['std']:.3f}   p = {row['p_value']:.2g}"
    )
