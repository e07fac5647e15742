# SPDX-License-Identifier: BSD-3-Clause
"""
Which effect looks like what?
=============================

The residual due to each missing effect is plotted against the signal that shows it best. The motion
of one arm is simulated without and with each effect on joint 1; the difference of the two torques
is the torque of the effect. A report of :func:`skidyn.diagnosis.diagnose` contains the same picture
for its findings, so the two can be compared.
"""

# %%
# The first picture shows four families. Dots are samples; their colour is the direction of motion
# (blue: forward, orange: backward), which separates friction from all other effects.
import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.effects import get_effect

LABELS = {
    "q": "position in rad", "dq": "velocity in rad/s", "ddq": "acceleration in rad/s²",
    "tau": "torque in N m", "time": "time in s",
}  # fmt: skip
BOTH, TOOL = ("coupled_friction", "coupled_inertia", "coupling_spring"), (
    "payload", "base_tilt", "external_wrench", "environment_contact",
)  # fmt: skip
MOTION = {"n_trajectories": 3, "duration": 8.0, "noise": 0.0, "random_state": 3}
DELAY = 0.01


def simulated(kind):
    """Log of the arm, with the same motion every time."""
    joints = [1, 2] if kind in BOTH else None if kind in (None, *TOOL) else [1]
    return make_hidden_effect_log(load_planar_arm(), kind, joints=joints, **MOTION)


def late(torque, time):
    """Torque that was recorded too late."""
    return np.interp(time - DELAY, time, torque)


plain = simulated(None)
TORQUE, TIME = np.asarray(plain.y)[:, 0], np.asarray(plain.X["time"])


def draw(ax, kind, signal):
    """Torque of an effect on joint 1 against a signal."""
    log = plain if kind == "time_delay" else simulated(kind)
    torque = late(TORQUE, TIME) if kind == "time_delay" else np.asarray(log.y)[:, 0]
    own = {"time": TIME, "tau": TORQUE}
    x = own[signal] if signal in own else np.asarray(log.X[f"{signal}1"])
    forward = np.asarray(log.X["dq1"]) > 0
    for here, colour in ((forward, "#0072b2"), (~forward, "#d55e00")):
        ax.plot(x[here], (torque - TORQUE)[here], ".", ms=1.5, color=colour)
    if np.ptp(torque - TORQUE) < 1e-6:  # an offset: its digits beyond that are rounding
        ax.set_ylim(0, 2 * np.max(torque - TORQUE))
    ax.set_title(get_effect(kind).title, fontsize=10)
    ax.set_xlabel(LABELS[signal], fontsize=8)
    ax.tick_params(labelsize=7)
    ax.grid(alpha=0.3)


figure, axes = plt.subplots(2, 2, figsize=(6.4, 4.6), layout="constrained")
FOUR = {"stribeck": "dq", "dahl": "q", "spring": "q", "rotor_inertia": "ddq"}
for ax, (kind, signal) in zip(axes.flat, FOUR.items(), strict=True):
    draw(ax, kind, signal)
figure.supylabel("torque of the effect in N m", fontsize=9)
plt.show()

# %%
# The second picture shows every kind of the catalogue: friction, hysteresis, functions of the
# position, inertia and the transmission, the torque sensor, and effects on the whole arm.
KINDS = {
    "viscous": "dq", "coulomb": "dq", "stribeck": "dq", "nonlinear_viscous": "dq",
    "asymmetric_friction": "dq", "load_dependent_friction": "dq",
    "temperature_friction": "dq", "coupled_friction": "dq",
    "position_dependent_friction": "q", "friction_drift": "time", "dahl": "q", "lugre": "q",
    "maxwell_slip": "q", "backlash": "q", "spring": "q", "nonlinear_spring": "q",
    "gravity_compensator": "q", "end_stop": "q", "torque_ripple": "q", "coupling_spring": "q",
    "rotor_inertia": "ddq", "coupled_inertia": "ddq", "joint_elasticity": "ddq",
    "torque_gain": "tau", "saturation": "tau", "time_delay": "dq", "offset": "time",
    "temperature_offset": "time", "payload": "time", "external_wrench": "time",
    "base_tilt": "q", "environment_contact": "q",
}  # fmt: skip
figure, axes = plt.subplots(8, 4, figsize=(10, 17), layout="constrained")
for ax, (kind, signal) in zip(axes.flat, KINDS.items(), strict=True):
    draw(ax, kind, signal)
figure.supylabel("torque of the effect in N m", fontsize=9)
plt.show()

# %%
# The families differ as follows:
#
# * **Friction** changes its sign with the direction: two branches, one per colour. Plain Coulomb
#   friction has two level branches; Stribeck friction rises towards zero velocity, nonlinear
#   viscous friction is curved, and load-dependent friction spreads with the torque of the gear.
# * **Hysteresis** makes loops against position: after each reversal the torque needs some travel
#   to reach the other branch.
# * **Springs, compensators, stops and ripple** are one curve against position, in both directions.
# * **Rotor inertia** depends on the acceleration, **gain and saturation** on the torque itself.
#   Elasticity, backlash and a delay of the torque are hard to see: use the numbers of the report,
#   which also states the motion that would separate effects that the log cannot separate.
# * **Payloads and forces at the tool** are present only in some recordings; drifting offsets depend
#   on time.
