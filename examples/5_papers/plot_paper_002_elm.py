# SPDX-License-Identifier: BSD-3-Clause
"""
ELM committee: amount of data and uncertainty
=============================================

Bargsten, de Gea Fernández and Kassahun compare identified parameters with a committee of extreme
learning machines, on the data to which both were fitted, and leave two questions to later work: a
test on other motions, and the amount of data that each needs. This example shows both, and
incremental learning.
"""

# %%
import os

import matplotlib.pyplot as plt
import numpy as np
from sklearn.linear_model import LinearRegression

from skidyn.committee import ELMCommittee
from skidyn.datasets import load_planar_arm
from skidyn.model_selection import trajectory_learning_curve

small = bool(os.environ.get("SKIDYN_SMALL"))
robot = load_planar_arm()
rng = np.random.default_rng(0)
t = np.arange(0, 4, 0.02)
tables, torques = [], []
for k in range(12 if small else 30):
    w, phase = 3 * rng.uniform(0.2, 1, 2), rng.uniform(0, 6, 2)
    angle = w * t[:, None] + phase
    q, dq, ddq = np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)
    tables.append(np.c_[np.full(len(t), k), q, dq, ddq])
    torque = robot.inverse_dynamics(q, dq, ddq) + np.tanh(dq / 0.05)
    torques.append(torque + 0.05 * rng.normal(size=q.shape))
X, y = np.concatenate(tables), np.concatenate(torques)


class Classical(LinearRegression):
    """Inertial parameters and friction of each joint by least squares."""

    def _design(self, X):
        regressor = robot.torque_regressor(X[:, 1:3], X[:, 3:5], X[:, 5:7])
        friction = np.zeros((len(X), 2, 4))
        friction[:, [0, 1], [0, 1]] = X[:, 3:5]
        friction[:, [0, 1], [2, 3]] = np.tanh(X[:, 3:5] / 0.05)
        return np.concatenate([regressor, friction], axis=2)

    def fit(self, X, y):
        """Least squares over all joints."""
        return super().fit(self._design(X).reshape(2 * len(X), -1), y.reshape(-1))

    def predict(self, X):
        """Torque of both joints (N m)."""
        return super().predict(self._design(X).reshape(2 * len(X), -1)).reshape(-1, 2)


# %%
# The picture has the error on trajectories to which neither was fitted, against the number of
# training trajectories.
models = {
    "identified parameters": Classical(),
    "ELM committee, p = 0.5": ELMCommittee(trajectory=0, random_state=0),
    "ELM committee, p = 0.999": ELMCommittee(p=0.999, trajectory=0, random_state=0),
}
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
for name, model in models.items():
    curve = trajectory_learning_curve(
        model, X, y, trajectory=0, cv=3, scoring="neg_root_mean_squared_error", random_state=0
    )
    error = -curve.test_scores.mean(axis=1)
    axes.loglog(curve.n_trajectories, error, "o-", label=name)
    print(name, error.round(3))
axes.set_xlabel("training trajectories")
axes.set_ylabel("held-out RMSE (N m)")
axes.legend()

# %%
# Incremental learning: ``partial_fit`` after every trajectory gives exactly the same result as a
# fit to all of them at once. The spread of the committee decreases where data is available.
committee = ELMCommittee(p=0.999, trajectory=0, random_state=0)
last = X[:, 0] == X[-1, 0]
spread = []
for k in np.unique(X[~last, 0]):
    rows = X[:, 0] == k
    committee.partial_fit(X[rows], y[rows])
    spread.append(committee.predict(X[last], return_std=True)[1].mean())
figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
axes.semilogy(np.arange(1, len(spread) + 1), spread)
axes.set_xlabel("trajectories learned")
axes.set_ylabel("spread on the next one (N m)")
plt.show()
