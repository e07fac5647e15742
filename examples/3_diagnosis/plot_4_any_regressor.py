# SPDX-License-Identifier: BSD-3-Clause
"""
Diagnose a model that is not skidyn's
=====================================

The model may be any fitted regressor of torque: the vendor's, a neural network, trees. It is not
changed; its residual on held-out motion is diagnosed.
"""

# %%
# The data contains a hidden spring at joint 1. The first model is plain scikit-learn: a linear
# regression on the columns of the rigid body and of friction, fitted to half of the trajectories.
import matplotlib.pyplot as plt
import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.linear_model import LinearRegression
from sklearn.multioutput import MultiOutputRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.inspection import ErrorMapDisplay

log = make_hidden_effect_log(
    load_planar_arm(), "spring", joints=[1], n_trajectories=12, duration=6.0
)
first = (log.X["trajectory"] <= 6).to_numpy()


def columns(X):
    """Rigid-body regressor of both joints, velocities and their signs."""
    q, dq, ddq = (X[[f"{s}1", f"{s}2"]].to_numpy() for s in ("q", "dq", "ddq"))
    rigid = log.robot.torque_regressor(q, dq, ddq).reshape(len(X), -1)
    return np.hstack([rigid, dq, np.tanh(dq / 0.01)])


linear = make_pipeline(FunctionTransformer(columns), LinearRegression()).fit(
    log.X[first], log.y[first]
)

# %%
# Such a regressor has no robot, so the robot is given. Its coefficients have taken up most of the
# spring as gravity of other bodies, so little of it is left in the residual.
diagnosis = diagnose(linear, log.X[~first], log.y[~first], robot=log.robot)
print("verdict:", diagnosis.verdict)
for finding in diagnosis.findings:
    print(finding.sentence)

# %%
# The coefficients of a fixed regressor are already biased by the missing effect, and an added
# effect cannot correct them. A model of skidyn is fitted again with each candidate, which tells the
# spring from gravity.
own = diagnose(RBDRegressor(log.robot), log.X[~first], log.y[~first])
for finding in own.findings:
    print(finding.sentence)

# %%
# Trees have no physical structure. Their errors are rarely due to a missing effect; they occur for
# motion that was rare in the training data.
SIGNALS = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
trees = make_pipeline(
    FunctionTransformer(lambda X: X[SIGNALS]),
    MultiOutputRegressor(HistGradientBoostingRegressor(max_iter=100, random_state=0)),
).fit(log.X[first], log.y[first])
of_trees = diagnose(trees, log.X[~first], log.y[~first], robot=log.robot)
for failure in of_trees.failures[:3]:
    print(failure.sentence)
for name, model in {"linear": linear, "trees": trees}.items():
    error = np.sqrt(np.mean((model.predict(log.X[~first]) - log.y[~first]) ** 2, axis=0))
    print(f"{name:8s} RMSE {np.round(error, 3)} N m")
ErrorMapDisplay.from_diagnosis(of_trees)
plt.show()
