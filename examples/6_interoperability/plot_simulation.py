# SPDX-License-Identifier: BSD-3-Clause
"""
Errors of the simulated motion
==============================

Models are often identified for simulation. Here a robot has a spring that its first model lacks;
the motion of both models is compared with a held-out recording.
"""

import matplotlib.pyplot as plt

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor
from skidyn.simulation import judge_by_simulation, simulate

log = make_hidden_effect_log(
    load_planar_arm(), "spring", joints=[1], n_trajectories=4, duration=6.0
)
train, test = log.frame["trajectory"] <= 3, log.frame["trajectory"] == 4
plain = RBDRegressor(log.robot).fit(log.X[train], log.y[train])
whole = plain.with_effects([("spring", [1])]).fit(log.X[train], log.y[train])

# %%
# Each second the models are reset to the log; they are driven by its torque.
print(judge_by_simulation(plain, whole, log.X[test], log.y[test]))

# %%
fig, axis = plt.subplots(figsize=(8, 3))
rows = slice(0, 600)
time = log.X["time"][test][rows]
axis.plot(time, log.X["q1"][test][rows], label="log")
for name, model in (("without the spring", plain), ("with it", whole)):
    motion = simulate(model, log.X[test][rows], log.y[test][rows], horizon=2.0)
    axis.plot(time, motion["q1"], "--", label=name)
axis.set(xlabel="time (s)", ylabel="joint 1 (rad)")
axis.legend()
fig.tight_layout()
