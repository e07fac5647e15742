# SPDX-License-Identifier: BSD-3-Clause
"""
The loop
========

Compare a model with measurements, see where it fails, learn which effect is missing, add it, watch
the error fall. The robot is simulated here, so that what is found can be compared with what was
hidden: the pre-sliding friction of joint 3 and a spring at joint 2.
"""

# %%
# A log: 8 trajectories of 6 s of a UR5. Two trajectories are put aside and used by nothing below
# until the end.
import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.inspection import ErrorBudgetDisplay, ErrorMapDisplay, ResidualDisplay, TorqueDisplay

hidden = {"dahl": {"joints": [3]}, "spring": {"joints": [2], "magnitude": 0.6}}
log = make_hidden_effect_log(load_ur5(), hidden, n_trajectories=8, duration=6.0, random_state=1)
aside = (log.X["trajectory"] > 6).to_numpy()
X, y = log.X[~aside], log.y[~aside]

# %%
# **Compare.** The model that most people have: a rigid body, viscous and Coulomb friction. It is
# fitted once for every trajectory that it then predicts.
model = RBDRegressor(log.robot, effects=("viscous", "coulomb"))
diagnosis = diagnose(model, X, y)
TorqueDisplay.from_estimator(model.fit(X, y), X, y, joint=3, trajectory=1)

# %%
# **See where it fails.** Rows are joints, columns regimes of motion.
for failure in diagnosis.failures[:4]:
    print(failure.sentence)
ErrorMapDisplay.from_diagnosis(diagnosis)

# %%
# **Learn what is missing**, with the line of code that adds it.
for finding in diagnosis.findings:
    print(finding.sentence)
    print("   ", finding.code)

# %%
# The evidence for the first of them: what the model leaves over, against the signal that the effect
# follows, and the effect's own curve.
ResidualDisplay.from_finding(diagnosis.findings[0])

# %%
# **Add it and watch the error fall**, here of joint 3. What is left above the noise floor lies at
# the starts of trajectories: how far the friction was wound up before is not in the log.
ErrorBudgetDisplay.from_diagnosis(diagnosis, joint=3)

# %%
# **On motion that nobody has seen**: the two trajectories put aside.
before = model.predict(log.X[aside]) - log.y[aside]
after = diagnosis.model.predict(log.X[aside]) - log.y[aside]
rmse = np.sqrt([(before**2).mean(axis=0), (after**2).mean(axis=0)])
for name, a, b in zip(log.robot.joint_names, *rmse, strict=True):
    print(f"{name:22s} {a:6.3f} -> {b:6.3f} N m")
plt.show()
