# SPDX-License-Identifier: BSD-3-Clause
"""
The identified arm in MuJoCo
============================

The identified parameters are exported to a simulator: masses, inertias, viscous and Coulomb
friction as MJCF fields. The written file is loaded by MuJoCo, and its inverse dynamics is compared
with the model's.
"""

# %%
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.export import write_mjcf
from skidyn.identification import RBDRegressor

try:
    import mujoco
except ImportError:
    print("MuJoCo is not installed: pip install mujoco")
    sys.exit(0)

log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4, duration=5.0)
# only physically possible bodies: a simulator refuses negative masses
model = RBDRegressor(log.robot, consistent=True).fit(log.X, log.y)
file = Path(tempfile.mkdtemp()) / "arm.xml"
left_out = write_mjcf(model, file)
print("no field for:", ", ".join(left_out) or "nothing")

# %%
# MuJoCo's inverse dynamics at 300 rows of the log. Its joint forces treat damping and dry friction
# separately, so Coulomb friction is compared while the joint slides.
arm = mujoco.MjModel.from_xml_path(str(file))
state = mujoco.MjData(arm)
rows = np.linspace(0, len(log.X) - 1, 300).astype(int)
torque = np.empty((len(rows), arm.nv))
for k, row in enumerate(rows):
    sample = log.X.iloc[row]
    state.qpos[:], state.qvel[:] = sample[["q1", "q2"]], sample[["dq1", "dq2"]]
    state.qacc[:] = sample[["ddq1", "ddq2"]]
    mujoco.mj_inverse(arm, state)
    torque[k] = state.qfrc_inverse
predicted = model.predict(log.X)[rows]

figure, axes = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
for j, axis in enumerate(axes):
    sliding = np.abs(log.X[f"dq{j + 1}"].to_numpy()[rows]) > 0.1
    difference = np.abs(torque[:, j] - predicted[:, j])[sliding]
    print(f"joint {j + 1}: largest difference while sliding {difference.max():.2g} N m")
    axis.plot(predicted[:, j], torque[:, j], ".", ms=3)
    axis.axline((0, 0), slope=1, color="k", lw=0.5)
    axis.set(xlabel=f"skidyn, joint {j + 1} (N m)", ylabel="MuJoCo (N m)")
plt.show()
