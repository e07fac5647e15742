# SPDX-License-Identifier: BSD-3-Clause
"""
The search as a scikit-learn estimator
======================================

:class:`~skidyn.diagnosis.EffectSearchCV` runs the loop automatically. It is compared with a grid
search over hand-picked effects; both are tested on held-out trajectories.
"""

# %%
# The log hides Stribeck friction in joint 2. Two of ten trajectories are held out for the test.
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from sklearn.model_selection import GridSearchCV, GroupKFold, GroupShuffleSplit

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import EffectSearchCV
from skidyn.identification import RBDRegressor

log = make_hidden_effect_log(
    load_planar_arm(), "stribeck", joints=[2], duration=5.0, random_state=4
)
groups = log.X["trajectory"].to_numpy()
train, test = next(GroupShuffleSplit(1, test_size=2, random_state=0).split(log.X, groups=groups))
X, y = log.X.iloc[train], log.y[train]

# %%
# The search uses the whole catalogue and stops when no further effect helps on held-out motion.
search = EffectSearchCV(RBDRegressor(log.robot)).fit(X, y)
print(pd.DataFrame(search.cv_results_)[["added", "mean_test_score", "rmse1", "rmse2"]].round(4))

# %%
# A grid search compares only the given candidates. Folds are whole trajectories: with random rows
# nearly every candidate would look good.
grid = GridSearchCV(
    RBDRegressor(log.robot),
    {
        "effects": [
            ("viscous", "coulomb"),
            ("viscous", "coulomb", "offset"),
            ("viscous", "coulomb", "dahl"),
            ("viscous", "coulomb", "stribeck"),
            ("viscous", "coulomb", "stribeck", "offset", "spring"),
        ]
    },
    cv=GroupKFold(4),
    scoring="neg_root_mean_squared_error",
).fit(X, y, groups=groups[train])
print("best of the grid:", grid.best_params_["effects"])

# %%
# Both are tested on the held-out trajectories.
models = {
    "start": RBDRegressor(log.robot).fit(X, y),
    "best of grid": grid.best_estimator_,
    "search": search.best_estimator_,
}
errors = {
    name: np.sqrt(np.mean((model.predict(log.X.iloc[test]) - log.y[test]) ** 2, axis=0))
    for name, model in models.items()
}
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
for k, (name, error) in enumerate(errors.items()):
    axes.bar(np.arange(2) + 0.27 * (k - 1), error, 0.25, label=name)
    print(f"{name:14s} {np.round(error, 4)} N m")
axes.set_xticks([0, 1], log.robot.joint_names)
axes.set_ylabel("RMSE on unseen motion (N m)")
axes.legend()
plt.show()
