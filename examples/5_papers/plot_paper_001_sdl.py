# SPDX-License-Identifier: BSD-3-Clause
"""
NDL and SDL: the benefit of the rigid body
==========================================

In the SDL paper, the rigid-body torque is an input of a network, and both are trained together. Far
from the training data the prediction should rely on the rigid body. Here the same network is
trained without the rigid body (NDL), as in the paper (SDL), and with the rigid-body torque added to
its output; then all of them predict motions faster than those they were trained on.
"""

# %%
# A planar arm is 30 % heavier than its description and has friction.
import os

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from skidyn.datasets import load_planar_arm
from skidyn.neural_network import NDLRegressor, SDLRegressor

small = bool(os.environ.get("SKIDYN_SMALL"))
robot = load_planar_arm()
rng = np.random.default_rng(0)
t = np.arange(0, 4, 0.02)


def record(n, speed, first=0):
    """Trajectories with speeds up to ``speed`` (rad/s), and their torque (N m)."""
    tables, torques = [], []
    for k in range(n):
        w, phase = speed * rng.uniform(0.3, 1, 2), rng.uniform(0, 6, 2)
        angle = w * t[:, None] + phase
        q, dq, ddq = np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)
        torque = robot.inverse_dynamics(q, dq, ddq, parameters=1.3 * robot.inertial_parameters)
        torques.append(torque + np.tanh(dq / 0.05) + 0.02 * rng.normal(size=q.shape))
        names = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
        tables.append(pd.DataFrame(np.c_[q, dq, ddq], columns=names).assign(trajectory=first + k))
    return pd.concat(tables, ignore_index=True), np.concatenate(torques)


X, y = record(6 if small else 15, 2.0)
tests = {"same speeds": record(5, 2.0, 100), "three times as fast": record(5, 6.0, 200)}

# %%
settings = {"max_epochs": 8 if small else 40, "random_state": 0}
models = {
    "NDL": NDLRegressor(**settings),
    "SDL as in the paper": SDLRegressor(robot, residual=False, **settings),
    "SDL, residual": SDLRegressor(robot, **settings),
    "SDL, residual, frozen": SDLRegressor(robot, rigid_body="frozen", **settings),
}
errors = {name: [] for name in models}
for name, model in models.items():
    model.fit(X, y)
    for test_X, test_y in tests.values():
        errors[name].append(np.sqrt(((model.predict(test_X) - test_y) ** 2).mean()))
    print(f"{name:24s}", "  ".join(f"{error:.2f} N m" for error in errors[name]))

# %%
# Out of range the network of SDL fades out; ``outside_range`` marks these samples.
fast, _ = tests["three times as fast"]
print(f"fast samples outside the range: {models['SDL, residual'].outside_range(fast).mean():.0%}")

figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
place = np.arange(len(models))
for i, name in enumerate(tests):
    axes.bar(place + 0.4 * i, [e[i] for e in errors.values()], 0.4, label=name)
axes.set_xticks(place + 0.2, list(models))
axes.set_ylabel("RMSE (N m)")
axes.legend()
plt.show()
