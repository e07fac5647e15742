# SPDX-License-Identifier: BSD-3-Clause
"""
An additional payload, and a missing hand
=========================================

In two logs the load differs from that of the model. A UR10e repeats its motion with 2.805 kg at the
flange, and the description of a Panda contains a hand of 0.73 kg that the recorded arm does not
have.
"""

# %%
import os
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from skidyn.diagnosis import Settings, diagnose
from skidyn.identification import RBDRegressor
from skidyn.logs import load_recording
from skidyn.robots import Robot

DATA = Path(os.environ.get("SKIDYN_DATA", "no folder given"))
if not (DATA / "ur10e").is_dir():
    print(
        "The recordings are not here; set SKIDYN_DATA to the folder that holds ur10e/ and panda/."
    )
    sys.exit(0)

# %%
# **UR10e.** Currents become torques by drive gains. With the published set, payloads are about 10 %
# too heavy; the factor 0.91 was found with a known load of the same robot on other days. Without
# that calibration only the product of mass and gain is known, which the finding states.
gains = 0.91 * np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
log = load_recording(
    DATA / "ur10e" / "ur10e_excitation.npz",
    run=["ur-20_02_19_14harm50sec", "ur-20_02_19_14harm50secLoad"],
    drive_gains=gains,
).frame
robot = Robot.from_urdf(DATA / "ur10e" / "ur10e_min.urdf")
model = RBDRegressor(robot, ("viscous", "coulomb", "offset", "rotor_inertia"))
once = Settings(max_findings=1)
PAYLOAD = diagnose(model, log, log[[f"tau{j + 1}" for j in range(6)]], settings=once).findings[0]
print(PAYLOAD.sentence)

# %%
# **Panda.** The parameters of the URDF are kept (``parameters="nominal"``): otherwise the
# identification would remove the hand without a message.
HAND = """
<link name="hand"><inertial><origin xyz="-0.01 0 0.03"/><mass value="0.73"/>
  <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.0025" iyz="0" izz="0.0017"/></inertial></link>
<joint name="hand_joint" type="fixed"><parent link="{last}"/><child link="hand"/>
  <origin xyz="0 0 0.107" rpy="0 0 -0.785398163397"/></joint>
</robot>"""
text = (DATA / "panda" / "panda_min.urdf").read_text()
last = Robot.from_urdf(text).body_names[-1]
wrong = Robot.from_urdf(text.replace("</robot>", HAND.format(last=last)))
log = load_recording(DATA / "panda" / "panda_gaz.npz").frame
model = RBDRegressor(wrong, ("viscous", "coulomb", "offset"), parameters="nominal")
ABSENT = diagnose(model, log, log[[f"tau{j + 1}" for j in range(7)]], settings=once).findings[0]
print(ABSENT.sentence)

# %%
# Both masses with their 95 % intervals, compared with the known values.
found = [finding.parameters["mass"] for finding in (PAYLOAD, ABSENT)]
names = ["UR10e, carried", "Panda, only described"]
fig, ax = plt.subplots(figsize=(6, 3.4), layout="constrained")
value = np.array([row["value"] for row in found])
ends = np.array([[row["low"], row["high"]] for row in found]).T
ax.errorbar(names, value, np.abs(ends - value), fmt="o", capsize=6, label="found, 95 %")
ax.plot(names, [2.805, -0.73], "_", ms=40, label="true difference from the description")
ax.axhline(0, color="0.8", lw=1)
ax.set(ylabel="mass (kg)", xlim=(-0.5, 1.5))
ax.legend(loc="center left")
plt.show()
