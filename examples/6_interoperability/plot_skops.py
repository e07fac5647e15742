# SPDX-License-Identifier: BSD-3-Clause
"""
Share a model as a file that is safe to load
============================================

A pickle can run any code of its author. `skops <https://skops.readthedocs.io>`__ stores a fitted
model so that its types can be inspected before anything is loaded.
"""

# %%
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor

try:
    import skops.io as sio
except ImportError:
    print("skops is not installed: pip install skidyn[share]")
    sys.exit(0)

log = make_hidden_effect_log(load_planar_arm(), "stribeck", n_trajectories=4, duration=5.0)
model = RBDRegressor(log.robot, ("viscous", "coulomb", "stribeck")).fit(log.X, log.y)
file = Path(tempfile.mkdtemp()) / "arm.skops"
sio.dump(model, file)
print(f"{file.name}: {file.stat().st_size / 1000:.0f} kB")

# %%
# The types in the file other than numbers and those of scikit-learn: check the list, then trust
# them.
types = sio.get_untrusted_types(file=file)
print("\n".join(types))
loaded = sio.load(file, trusted=types)
print("same prediction:", np.array_equal(loaded.predict(log.X), model.predict(log.X)))

# %%
# The picture has one second of the log around a reversal of the second joint.
part = slice(100, 200)
time = log.X["time"].to_numpy()[part]
fig, ax = plt.subplots(figsize=(6, 3.4), layout="constrained")
ax.plot(time, log.y[part, 1], color="0.7", lw=4, label="measured")
ax.plot(time, model.predict(log.X)[part, 1], label="model before it is saved")
ax.plot(time, loaded.predict(log.X)[part, 1], "--", label="model from the file")
ax.set(xlabel="time (s)", ylabel="torque of joint 2 (N m)")
ax.legend()
plt.show()
