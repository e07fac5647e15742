# SPDX-License-Identifier: BSD-3-Clause
"""
Which effect looks like what?
=============================

What a missing effect leaves in the residual, drawn against the signal that shows it best. The
motion of one arm is simulated once without and once with each effect on joint 1; the difference of
the two torques is the torque of the effect. A report of
:func:`skidyn.diagnosis.diagnose` draws the same picture for what it has found: compare the two.
"""

# %%
# Friction, hysteresis, springs, the transmission and the torque sensor, in this order. Dots are
# samples; their colour is the direction of motion, which separates friction from everything else.
import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import get_effect

KINDS = {
    "stribeck": "dq", "nonlinear_viscous": "dq", "asymmetric_friction": "dq",
    "load_dependent_friction": "dq", "position_dependent_friction": "q", "friction_drift": "time",
    "dahl": "q", "lugre": "q", "maxwell_slip": "q",
    "spring": "q", "nonlinear_spring": "q", "gravity_compensator": "q",
    "end_stop": "q", "torque_ripple": "q", "rotor_inertia": "ddq",
    "coupling_spring": "q", "torque_gain": "tau", "saturation": "tau",
}  # fmt: skip
LABELS = {
    "q": "position in rad", "dq": "velocity in rad/s", "ddq": "acceleration in rad/s²",
    "tau": "torque in N m", "time": "time in s",
}  # fmt: skip
ON = {"coupling_spring": [1, 2]}
MOTION = {"n_trajectories": 3, "duration": 8.0, "noise": 0.0, "random_state": 3}


def simulated(effect):
    """Log of the arm, with the same motion every time."""
    return make_hidden_effect_log(
        load_planar_arm(), effect, joints=ON.get(effect, effect and [1]), **MOTION
    )


plain = simulated(None)
figure, axes = plt.subplots(6, 3, figsize=(10, 15), layout="constrained")
for ax, (kind, signal) in zip(axes.flat, KINDS.items(), strict=True):
    log = simulated(kind)
    effect = np.asarray(log.y)[:, 0] - np.asarray(plain.y)[:, 0]
    x = log.X["time"] if signal == "time" else np.asarray(
        plain.y[:, 0] if signal == "tau" else log.X[f"{signal}1"]
    )  # fmt: skip
    forward = np.asarray(log.X["dq1"]) > 0
    for here, colour in ((forward, "#0072b2"), (~forward, "#d55e00")):
        ax.plot(np.asarray(x)[here], effect[here], ".", ms=1.5, color=colour)
    ax.set_title(get_effect(kind).title, fontsize=10)
    ax.set_xlabel(LABELS[signal], fontsize=8)
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.3)
figure.supylabel("torque of the effect in N m (blue: forward, orange: backward)", fontsize=9)
plt.show()

# %%
# What separates the families:
#
# * **Friction** changes its sign with the direction: two branches, one per colour. Plain Coulomb
#   friction has two level branches; Stribeck friction rises towards zero velocity, a nonlinear
#   viscous one bends, a load-dependent one spreads with the torque that the gear carries.
# * **Hysteresis** makes loops against position: after each reversal the torque needs some travel
#   to come over to the other branch.
# * **Springs, compensators, stops and ripple** are one curve against position, whatever the
#   direction.
# * **Rotor inertia** follows the acceleration, **gain and saturation** the torque itself.
#   Elasticity, backlash and a delay of the torque do so too, but too faintly for the eye: there the
#   report's numbers decide, and it names the motion that would separate what they cannot.
