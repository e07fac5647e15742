# SPDX-License-Identifier: BSD-3-Clause
"""
When nothing is missing
=======================

Sometimes the model lacks no effect that the data can show. Then two questions remain: how much
better could any model be, and how large could an effect be without being detected in this data?
"""

# %%
# The log is that of a SCARA arm, one of whose joints slides, with exactly the friction of the
# model.
import matplotlib.pyplot as plt

from skidyn.datasets import load_scara, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

log = make_hidden_effect_log(load_scara(), None, n_trajectories=6, duration=5.0, random_state=5)
diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)
print("verdict:", diagnosis.verdict)
print("findings:", [finding.kind for finding in diagnosis.findings])

# %%
# The held-out error is at the noise floor: no model of these signals could do much better.
print("joint           error    floor")
for row in zip(log.robot.joint_names, diagnosis.rmse_before, diagnosis.noise_floor, strict=True):
    print("{:14s} {:7.4f}  {:7.4f}".format(*row))

# %%
# The next table has the limits of hidden effects. If ``largest_hidden`` is ``None``, this log
# cannot show the effect at any size, for instance because no temperature was logged.
for limit in [limit for limit in diagnosis.limits if limit.joint == 1][:8]:
    print(limit.sentence)

# %%
# The picture has the limits of dry-friction effects as a share of each joint's torque. The log
# excludes larger effects.
kinds = ("offset", "dahl", "stribeck", "position_dependent_friction", "maxwell_slip")
spread = log.y.std(axis=0)
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
for k, kind in enumerate(kinds):
    for limit in diagnosis.limits:
        if limit.kind == kind and limit.largest_hidden is not None:
            share = limit.largest_hidden / spread[limit.joint - 1]
            axes.plot(share, k + 0.12 * (limit.joint - 2.5), "o", color=f"C{limit.joint - 1}")
for j, name in enumerate(log.robot.joint_names):
    axes.plot([], [], "o", color=f"C{j}", label=name)
axes.set_yticks(range(len(kinds)), kinds)
axes.set(xscale="log", xlabel="largest hidden magnitude / spread of the joint's torque")
axes.legend(fontsize="small", bbox_to_anchor=(1.01, 1), loc="upper left")
plt.show()
