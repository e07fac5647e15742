# SPDX-License-Identifier: BSD-3-Clause
"""
Which friction model?
=====================

The candidates are fitted, predict held-out trajectories, and are compared by their errors. A model
that is too simple for the joint has a larger error; one that is more complex than needed is hardly
worse. Four simulated arms differ only in the friction of joint 1.
"""

# %%
# The effects of a candidate are kinds of the catalogue. Kinds with shape parameters, such as the
# Stribeck velocity, get them from the data when the model is fitted.
import matplotlib.pyplot as plt
import numpy as np
from sklearn.model_selection import cross_validate

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import EffectSearchCV
from skidyn.identification import RBDRegressor
from skidyn.model_selection import TrajectoryKFold

CANDIDATES = {
    "viscous": ("viscous",),
    "+ Coulomb": ("viscous", "coulomb"),
    "+ Stribeck": ("viscous", "coulomb", "stribeck"),
    "+ Dahl": ("viscous", "coulomb", "dahl"),
    "+ load": ("viscous", "coulomb", "load_dependent_friction"),
}
ARMS = {
    "Coulomb only": None,
    "Stribeck": "stribeck",
    "pre-sliding (Dahl)": "dahl",
    "grows with load": "load_dependent_friction",
}
errors = np.empty((len(ARMS), len(CANDIDATES)))
chosen = {}
for row, (arm, effect) in enumerate(ARMS.items()):
    log = make_hidden_effect_log(
        load_planar_arm(), effect, joints=effect and [1], n_trajectories=6, duration=4.0
    )
    for column, effects in enumerate(CANDIDATES.values()):
        scores = cross_validate(
            RBDRegressor(log.robot, effects),
            log.X,
            log.y,
            cv=TrajectoryKFold(3),
            scoring="neg_root_mean_squared_error",
        )
        errors[row, column] = -scores["test_score"].mean()
    search = EffectSearchCV(RBDRegressor(log.robot)).fit(log.X, log.y)
    chosen[arm] = [str(kind) for kind in search.cv_results_["added"][1:]]

# %%
# The search of the diagnosis uses the whole catalogue; its first finding is the true effect.
for arm, kinds in chosen.items():
    print(f"{arm:20s} {', '.join(kinds) or 'nothing to add'}")

# %%
# The table has the held-out error relative to the best candidate of each arm.
relative = errors / errors.min(axis=1, keepdims=True)
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
axes.imshow(np.log(relative), cmap="Blues", aspect="auto", vmax=0.8)
axes.set_xticks(range(len(CANDIDATES)), list(CANDIDATES))
axes.set_yticks(range(len(ARMS)), list(ARMS))
for i, j in np.ndindex(*relative.shape):
    axes.text(j, i, f"{relative[i, j]:.2f}", ha="center", va="center",
              color="white" if relative[i, j] > 1.7 else "black")  # fmt: skip
axes.set(xlabel="model", ylabel="true friction of joint 1")
plt.show()
