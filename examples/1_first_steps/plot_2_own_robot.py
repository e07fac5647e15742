# SPDX-License-Identifier: BSD-3-Clause
"""
Your own robot and your own log
===============================

A model with a known error is made from a URDF and CSV files with their own column names and units.
The files are generated here; replace them by yours.
"""

# %%
# A logger could write two such files, with positions in degrees and time in milliseconds.
import tempfile
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from skidyn.datasets import make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.inspection import ErrorBudgetDisplay
from skidyn.logs import check_log, read_log
from skidyn.report import summarize, write_html
from skidyn.robots import Robot

URDF = """
<robot name="wall_arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.18 0 0"/><mass value="3.1"/>
    <inertia ixx="0.004" iyy="0.030" izz="0.030" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.14 0 0"/><mass value="1.6"/>
    <inertia ixx="0.002" iyy="0.012" izz="0.012" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 1 0"/><limit lower="-2.8" upper="2.8" effort="60" velocity="3"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.36 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="2.5" effort="30" velocity="4"/></joint>
</robot>
"""
folder = Path(tempfile.mkdtemp())
(folder / "arm.urdf").write_text(URDF)

made_up = make_hidden_effect_log(
    Robot.from_urdf(URDF),
    "load_dependent_friction",
    joints=[1],
    magnitude=1.5,
    n_trajectories=6,
    duration=6.0,
)
files = []
for number, run in made_up.frame.groupby("trajectory"):
    recorded = pd.DataFrame({"stamp": 1000 * run["time"]})
    for j, joint in enumerate(("Shoulder", "Elbow"), start=1):
        recorded[f"{joint}_angle"] = np.degrees(run[f"q{j}"])
        recorded[f"{joint}_torque"] = run[f"tau{j}"]
    files.append(folder / f"run{number}.csv")
    recorded.to_csv(files[-1], index=False)
print(files[0].read_text()[:200])

# %%
# **Read.** Column names are matched to the joints of the URDF; velocities that are not recorded are
# derived. All decisions are reported.
robot = Robot.from_urdf(folder / "arm.urdf")
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # the notes are printed instead
    log = read_log(files, robot=robot, units={"q": "deg", "time": "ms"}, check=False)
for note in log.attrs["notes"]:
    print(note)
print(log.head(3).round(3))

# %%
# **Check the log before any model.** Without the units, this check would show the error.
print(check_log(log, robot))
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # the notes have been read above
    forgotten = read_log(files, robot=robot, check=False)
print("\nwithout units:", check_log(forgotten, robot).warnings[0])

# %%
# **Diagnose** and write a page that can be shared.
tau = log[["tau1", "tau2"]].to_numpy()
diagnosis = diagnose(RBDRegressor(robot), log, tau)
for finding in diagnosis.findings:
    print(finding.sentence)
page = write_html(folder / "report.html", summarize(diagnosis, title="Wall arm"))
print(page.name, f"{page.stat().st_size / 1e6:.1f} MB")

# %%
ErrorBudgetDisplay.from_diagnosis(diagnosis, joint=1)
plt.show()
