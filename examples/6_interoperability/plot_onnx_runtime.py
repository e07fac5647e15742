# SPDX-License-Identifier: BSD-3-Clause
"""
The model in ONNX Runtime
=========================

A controller without Python and without a robot library can run a model in ONNX Runtime: rigid
bodies, friction and every other effect that is a function of q, dq and ddq, in double precision,
for any number of samples.
"""

# %%
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.export import write_onnx
from skidyn.identification import RBDRegressor

try:
    import onnx  # noqa: F401
    import onnxruntime
except ImportError as error:
    print(f"{error}; pip install onnxruntime skidyn[export]")
    sys.exit(0)

log = make_hidden_effect_log(load_ur5(), None, n_trajectories=4, duration=5.0)
model = RBDRegressor(log.robot).fit(log.X, log.y)
file = Path(tempfile.mkdtemp()) / "ur5.onnx"
left_out = write_onnx(model, file)
print(f"{file.name}: {file.stat().st_size / 1000:.0f} kB, not in it: {left_out or 'nothing'}")

# %%
# The file is run without skidyn.
session = onnxruntime.InferenceSession(str(file))
joints = range(1, log.robot.n_joints + 1)
inputs = {s: log.X[[f"{s}{j}" for j in joints]].to_numpy() for s in ("q", "dq", "ddq")}
(torque,) = session.run(["tau"], inputs)
print(f"largest difference {np.abs(torque - model.predict(log.X)).max():.1g} N m")

one = (log.X["trajectory"] == 1).to_numpy()
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
axes.plot(log.X["time"][one], log.y[one, 1], color="0.6", label="measured")
axes.plot(log.X["time"][one], torque[one, 1], "--", label="ONNX Runtime")
axes.set(xlabel="time (s)", ylabel=f"{log.robot.joint_names[1]} (N m)")
axes.legend()
plt.show()
