# SPDX-License-Identifier: BSD-3-Clause
"""
The model in ONNX Runtime
=========================

A controller that knows neither Python nor robots can run a model in ONNX Runtime. The rigid body of
a :class:`~skidyn.robots.Robot` is written in torch as well, so that torch's own exporter makes an
ONNX file of it, friction included, for any number of samples.
"""

# %%
import sys
import tempfile
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import torch

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.export import model_terms
from skidyn.rigid_body import RBDRegressor

try:
    import onnxruntime
    import onnxscript  # noqa: F401  torch's exporter needs it
except ImportError as error:
    print(f"{error}; pip install onnxruntime skidyn[export]")
    sys.exit(0)

log = make_hidden_effect_log(load_ur5(), None, n_trajectories=4, duration=5.0)
model = RBDRegressor(log.robot).fit(log.X, log.y)
terms, rest = model_terms(model)
print("terms:", ", ".join(terms), "- not written:", ", ".join(rest) or "nothing")


# %%
# The whole model: rigid body, viscous friction, Coulomb friction with its direction blurred around
# rest as it is in skidyn.
class Torque(torch.nn.Module):
    """Joint torque in N m from q, dq, ddq of shape (n_samples, n_joints)."""

    def __init__(self):
        super().__init__()
        self.values = {name: torch.as_tensor(np.asarray(value)) for name, value in terms.items()}

    def forward(self, q, dq, ddq):
        """Rigid body and friction."""
        rigid = log.robot.inverse_dynamics_torch(q, dq, ddq, self.values["parameters"])
        direction = torch.tanh(dq / self.values["blur"])
        return rigid + self.values["viscous"] * dq + self.values["coulomb"] * direction


joints = range(1, log.robot.n_joints + 1)
inputs = {s: log.X[[f"{s}{j}" for j in joints]].to_numpy() for s in ("q", "dq", "ddq")}
some = tuple(torch.tensor(values[:7]) for values in inputs.values())
rows = {0: torch.export.Dim("n_samples")}
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # the exporter talks about its own future
    program = torch.onnx.export(
        Torque().eval(),
        some,
        dynamo=True,
        dynamic_shapes=(rows, rows, rows),
        input_names=list(inputs),
        output_names=["tau"],
        verbose=False,
    )
file = Path(tempfile.mkdtemp()) / "ur5.onnx"
program.save(str(file))
print(f"{file.name}: {file.stat().st_size / 1000:.0f} kB")

# %%
# Without torch and without skidyn.
session = onnxruntime.InferenceSession(str(file))
(torque,) = session.run(["tau"], inputs)
print(f"largest difference {np.abs(torque - model.predict(log.X)).max():.1g} N m")

one = (log.X["trajectory"] == 1).to_numpy()
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
axes.plot(log.X["time"][one], log.y[one, 1], color="0.6", label="measured")
axes.plot(log.X["time"][one], torque[one, 1], "--", label="ONNX Runtime")
axes.set(xlabel="time (s)", ylabel=f"{log.robot.joint_names[1]} (N m)")
axes.legend()
plt.show()
