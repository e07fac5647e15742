# SPDX-License-Identifier: BSD-3-Clause
"""
BLL: a forecast is not a model
==============================

The BLL paper (Tao et al., Robotica 43, 2025) reports residual torques predicted to a few hundredths
of a newton metre. Its network reads the residuals *measured so far* and predicts the next one. That
is a forecast, and a forecast of a smooth signal is easy: a straight line is sufficient. A model of
the torque must predict it from the motion alone. Here both are done with the same data.
"""

# %%
# The friction of a two-joint arm has a pre-sliding part that the physics does not contain.
import os

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from sklearn.linear_model import LinearRegression

from skidyn._signals import Signals
from skidyn.effects import get_effect
from skidyn.forecasting import AutoregressiveRegressor, PersistenceRegressor, forecast_table
from skidyn.hybrid import HybridRegressor
from skidyn.model_selection import TrajectoryKFold
from skidyn.neural_network import BLLRegressor, LSTMRegressor
from skidyn.preprocessing import cross_fitted_residual

small = bool(os.environ.get("SKIDYN_SMALL"))
rng = np.random.default_rng(0)
t = np.arange(0, 6, 0.02)
tables = []
for k in range(8 if small else 16):
    w, phase = rng.uniform(0.8, 3, 2), rng.uniform(0, 6, 2)
    angle = w * t[:, None] + phase
    q, dq, ddq = 0.3 * np.sin(angle), 0.3 * w * np.cos(angle), -0.3 * w**2 * np.sin(angle)
    names = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
    tables.append(pd.DataFrame(np.c_[q, dq, ddq], columns=names).assign(trajectory=k, time=t))
X = pd.concat(tables, ignore_index=True)
state = [X[[f"{s}1", f"{s}2"]].to_numpy() for s in ("q", "dq", "ddq")]
signals = Signals(*state, trajectory=X["trajectory"].to_numpy(), time=X["time"].to_numpy())
hidden = np.column_stack(
    [get_effect("dahl").columns(signals, j, presliding=0.05)[:, 0] for j in (0, 1)]
)
y = 2 * state[2] + state[1] + 3 * hidden + 0.05 * rng.normal(size=hidden.shape)

# %%
# The hidden friction remains in the residual of the physics (here linear in the signals).
physics = LinearRegression()
residual = cross_fitted_residual(physics, X, y)
print(f"residual of the physics: {residual.std():.3f} N m")

# %%
# **Forecasting.** Each residual is predicted from the earlier measured ones. Such numbers should
# always be compared with persistence and an autoregression.
table = forecast_table(residual, X["trajectory"])
train = table.X[:, 0] < 0.7 * X["trajectory"].max()
epochs = 5 if small else 20
forecasters = {
    "persistence": PersistenceRegressor(trajectory=0),
    "AR(10)": AutoregressiveRegressor(10, trajectory=0),
    "BLL": BLLRegressor(
        LSTMRegressor(window=10, max_epochs=epochs), n_estimators=3, trajectory=0, random_state=0
    ),
}
errors = {}
for name, model in forecasters.items():
    forecast = model.fit(table.X[train], table.y[train]).predict(table.X[~train])
    errors[f"forecast: {name}"] = np.sqrt(((table.y[~train] - forecast) ** 2).mean())

# %%
# **Modelling.** The torque is predicted from the motion, on held-out trajectories.
member = LSTMRegressor(max_epochs=epochs)
models = {
    "model: physics": physics,
    "model: physics + BLL": HybridRegressor(
        physics, BLLRegressor(member, n_estimators=3, random_state=0), cv=3
    ),
    "model: physics + own joints": HybridRegressor(physics, cv=3),
}
for name, model in models.items():
    prediction = np.zeros_like(y)
    for a, b in TrajectoryKFold(3).split(X):
        prediction[b] = model.fit(X.iloc[a], y[a]).predict(X.iloc[b])
    errors[name] = np.sqrt(((y - prediction) ** 2).mean())
for name, error in errors.items():
    print(f"{name:28s} {error:.3f} N m")

# %%
# The forecasts look best, and a plain autoregression is as good as the network. They are no measure
# of a model of the robot's torque: none of them could compute a feedforward torque.
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
axes.barh(list(errors), list(errors.values()), color=["C7"] * 3 + ["C0"] * 3)
axes.invert_yaxis()
axes.set_xlabel("held-out RMSE (N m)")
plt.show()
