# SPDX-License-Identifier: BSD-3-Clause
"""
pandas, polars, NumPy
=====================

A table with names is the safest input: the order of its columns is free, further columns are
ignored, and key columns are found by name. An array works too once its key columns are named by
position. All three give the same model.
"""

# %%
import sys

import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor
from skidyn.preprocessing import SmoothDerivatives

try:
    import polars as pl
except ImportError:
    print("polars is not installed: pip install polars")
    sys.exit(0)

log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=5.0)
shuffled = log.X[sorted(log.X.columns, reverse=True)].assign(volts=24.0)

from_pandas = RBDRegressor(log.robot).fit(log.X, log.y)
from_shuffled = RBDRegressor(log.robot).fit(shuffled, log.y)
table = pl.from_pandas(log.X)
from_polars = RBDRegressor(log.robot).fit(table, log.y)

# %%
# The array has ``time`` and ``trajectory`` first, then q, dq and ddq of all joints.
signals = [f"{s}{j}" for s in ("q", "dq", "ddq") for j in (1, 2)]
array = log.X[["time", "trajectory", *signals]].to_numpy()
from_array = RBDRegressor(log.robot, time=0, trajectory=1).fit(array, log.y)

for name, model, X in (
    ("shuffled pandas", from_shuffled, shuffled),
    ("polars", from_polars, table),
    ("array", from_array, array),
):
    same = np.allclose(model.predict(X), from_pandas.predict(log.X), rtol=1e-12)
    print(f"{name:16s} same prediction: {same}")

# %%
# Transformers return the requested kind of table.
positions = table.select("time", "trajectory", "q1", "q2")
smooth = SmoothDerivatives().set_output(transform="polars")
smoothed = smooth.fit_transform(positions)
print(smoothed.head(3))

# %%
# The picture compares the velocity derived from positions alone with the recorded one.
part = slice(100, 300)
time = log.X["time"].to_numpy()[part]
fig, ax = plt.subplots(figsize=(6, 3.4), layout="constrained")
ax.plot(time, log.X["dq1"].to_numpy()[part], color="0.6", lw=3, label="recorded, pandas")
ax.plot(time, smoothed["dq1"].to_numpy()[part], label="from positions, polars")
ax.set(xlabel="time (s)", ylabel="velocity of joint 1 (rad/s)")
ax.legend()
plt.show()
