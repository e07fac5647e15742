# SPDX-License-Identifier: BSD-3-Clause
"""
A payload, and the effect of a wrong drive gain
===============================================

An arm repeats its motion with a load at the flange. Runs with and without it give the load's mass
and centre of mass with intervals; wrong gains give another mass with the same small residual, and
only a known load shows that they are wrong.
"""

# %%
import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.payload import estimate_drive_gains, identify_payload

friction = ("viscous", "coulomb")
log = make_hidden_effect_log(
    load_ur5(),
    "payload",
    base=friction,
    n_trajectories=6,
    duration=8.0,
    noise="high",
    random_state=1,
)
carries = log.frame["trajectory"].isin(log.parameters["trajectories"])
loaded, unloaded = log.frame[carries], log.frame[~carries]
found = identify_payload(log.robot, loaded, unloaded, effects=friction)
print(f"true: {log.parameters['mass']:.3f} kg at {np.round(log.parameters['com'], 4)} m")
print(found.text)

# %%
# The same runs with drive gains that are wrong by a common factor: the mass changes by this factor,
# while the residual of the loaded runs, relative to the torque, does not change.
torques = [f"tau{j}" for j in range(1, 7)]
factors = np.array([0.8, 0.9, 1.0, 1.1, 1.2])
masses, low, high = [], [], []
for factor in factors:
    wrong = [
        frame.assign(**{c: factor * frame[c] for c in torques}) for frame in (loaded, unloaded)
    ]
    estimate = identify_payload(log.robot, *wrong, effects=friction)
    masses.append(estimate.mass)
    low.append(estimate.mass - estimate.mass_interval[0])
    high.append(estimate.mass_interval[1] - estimate.mass)

figure, axis = plt.subplots(figsize=(6, 3.5))
axis.errorbar(factors, masses, [low, high], fmt="o", capsize=4, label="identified, 95 %")
axis.axhline(log.parameters["mass"], color="0.5", linestyle="--", label="true mass")
axis.set(xlabel="drive gains over the true ones", ylabel="mass of the payload in kg")
axis.legend()
figure.tight_layout()

# %%
# With the mass known, the currents give the gains themselves.
gains = np.array([14.0, 13.0, 11.0, 10.0, 12.0, 9.0])
currents = [
    frame.assign(**{c: frame[c] / g for c, g in zip(torques, gains, strict=True)})
    for frame in (loaded, unloaded)
]
estimate = estimate_drive_gains(log.robot, *currents, log.parameters["mass"], effects=friction)
print(estimate.text)
print("true:", gains)
