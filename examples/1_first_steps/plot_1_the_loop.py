# SPDX-License-Identifier: BSD-3-Clause
"""
The loop
========

Compare a model with measurements, see where it fails, find the missing effect, add it, and compare
the errors. The robot is simulated here, so that the findings can be compared with the hidden
effects: pre-sliding friction of joint 3 and a spring at joint 2.
"""

# %%
# The log has 8 trajectories of 4 s of a UR5. Two of them are held out and used only at the end.
import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.inspection import ErrorBudgetDisplay, ErrorMapDisplay, ResidualDisplay, TorqueDisplay

hidden = {"dahl": {"joints": [3]}, "spring": {"joints": [2], "magnitude": 0.6}}
log = make_hidden_effect_log(load_ur5(), hidden, n_trajectories=8, duration=4.0, random_state=1)
aside = (log.X["trajectory"] > 6).to_numpy()
X, y = log.X[~aside], log.y[~aside]

# %%
# **Compare.** The usual model has a rigid body, viscous and Coulomb friction. Each trajectory is
# predicted by a model that was fitted to the other ones.
model = RBDRegressor(log.robot, effects=("viscous", "coulomb"))
diagnosis = diagnose(model, X, y)
TorqueDisplay.from_estimator(model.fit(X, y), X, y, joint=3, trajectory=1)

# %%
# **See where it fails.** The rows are joints, the columns are regimes of motion.
for failure in diagnosis.failures[:4]:
    print(failure.sentence)
ErrorMapDisplay.from_diagnosis(diagnosis)

# %%
# **Find the missing effects.** Each is printed with the line of code that adds it.
for finding in diagnosis.findings:
    print(finding.sentence)
    print("   ", finding.code)

# %%
# The evidence for the first of them is the residual of the model against the signal on which the
# effect depends, with the curve of the effect.
ResidualDisplay.from_finding(diagnosis.findings[0])

# %%
# **Add them and compare the errors**, here those of joint 3. The remaining error above the noise
# floor is at the starts of trajectories: the state of the friction before them is not in the log.
ErrorBudgetDisplay.from_diagnosis(diagnosis, joint=3)

# %%
# **Test the model on new motion**, the two held-out trajectories.
before = model.predict(log.X[aside]) - log.y[aside]
after = diagnosis.model.predict(log.X[aside]) - log.y[aside]
rmse = np.sqrt([(before**2).mean(axis=0), (after**2).mean(axis=0)])
for name, a, b in zip(log.robot.joint_names, *rmse, strict=True):
    print(f"{name:22s} {a:6.3f} -> {b:6.3f} N m")
plt.show()
