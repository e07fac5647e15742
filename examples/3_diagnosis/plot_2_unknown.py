# SPDX-License-Identifier: BSD-3-Clause
"""
The unknown: something is missing that has no name
==================================================

A cable that is dragged along makes a torque that depends on two joints and follows no formula of
the catalogue. The diagnosis must not call it a friction that it is not. It says ``unknown``, on
which joints, on which signals it depends and how much of the error it is, and draws it.
"""

# %%
import matplotlib.pyplot as plt

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.inspection import ResidualDisplay

log = make_hidden_effect_log(load_planar_arm(), "unknown_cable", random_state=2)
print("hidden:", log.truth[0]["formula"], "on joints", log.truth[0]["joints"])

# %%
diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)
print("verdict:", diagnosis.verdict)
for finding in diagnosis.findings:
    print(finding.sentence)

# %%
# One finding per joint. The shapes, which whoever knows the robot may recognise and write down as
# an effect:
for finding in diagnosis.findings:
    ResidualDisplay.from_finding(finding, joint=finding.joints[0])

# %%
# Where a short formula does as well as the shape that was measured, it can be added like any
# effect; ``diagnosis.model`` has it already. The next diagnosis starts from there.
print(diagnosis.findings[0].code)
print("held-out RMSE", diagnosis.rmse_before.round(3), "->", diagnosis.rmse_after.round(3), "N m")
plt.show()
