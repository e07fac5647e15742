# SPDX-License-Identifier: BSD-3-Clause
"""
An unknown effect
=================

A cable that is dragged along causes a torque that depends on two joints and has no formula in the
catalogue. The diagnosis must not report it as friction. It reports an ``unknown`` effect with its
joints, the signals on which it depends and its share of the error, and plots it.
"""

# %%
import matplotlib.pyplot as plt

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.inspection import ResidualDisplay

log = make_hidden_effect_log(
    load_planar_arm(), "unknown_cable", n_trajectories=6, duration=6.0, random_state=2
)
print("hidden:", log.truth[0]["formula"], "on joints", log.truth[0]["joints"])

# %%
diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)
print("verdict:", diagnosis.verdict)
for finding in diagnosis.findings:
    print(finding.sentence)

# %%
# There is one finding per joint. A person who knows the robot may recognise the shapes and define
# them as an effect:
for finding in diagnosis.findings:
    ResidualDisplay.from_finding(finding, joint=finding.joints[0])

# %%
# If a short formula fits as well as the measured shape, it can be added like any effect;
# ``diagnosis.model`` contains it already. The next diagnosis can start from this model.
print(diagnosis.findings[0].code)
print("held-out RMSE", diagnosis.rmse_before.round(3), "->", diagnosis.rmse_after.round(3), "N m")
plt.show()
