# SPDX-License-Identifier: BSD-3-Clause
"""
Friction as features of any regressor
=====================================

:class:`~skidyn.effects.FrictionTransformer` appends the columns of friction effects to X, so that a
plain scikit-learn regressor can use them: here a linear model per joint, and boosted trees with the
direction of motion as a feature. It can be used as a Pipeline step.
"""

# %%
# One joint with Coulomb and viscous friction that swings a pendulum: gravity is ``sin(q)``.
import matplotlib.pyplot as plt
import numpy as np
from sklearn.compose import make_column_transformer
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

from skidyn.datasets import make_hidden_effect_log
from skidyn.effects import FrictionTransformer
from skidyn.model_selection import TrajectoryKFold
from skidyn.preprocessing import DropKeys
from skidyn.robots import Robot

URDF = """
<robot name="pendulum"><link name="base"/>
  <link name="rod"><inertial><origin xyz="0.4 0 0"/><mass value="2"/>
    <inertia ixx="0.001" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="pivot" type="revolute"><parent link="base"/><child link="rod"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="30" velocity="6"/></joint></robot>
"""
log = make_hidden_effect_log(Robot.from_urdf(URDF), None, n_trajectories=6, duration=6.0)
X, y = log.X, log.y.ravel()

# %%
# The pipeline consists of sine and cosine of the position for gravity, the columns of friction and
# a linear model. The number of the trajectory and the time are not features; ``DropKeys`` removes
# them.
features = DropKeys().set_output(transform="pandas")
friction = FrictionTransformer().set_output(transform="pandas")
trees = HistGradientBoostingRegressor(max_iter=100, random_state=0)
gravity = make_column_transformer(
    (FunctionTransformer(lambda q: np.c_[np.sin(q), np.cos(q)]), ["q1"]), remainder="passthrough"
)
models = {
    "linear": make_pipeline(features, gravity, LinearRegression()),
    "linear + friction": make_pipeline(friction, features, gravity, LinearRegression()),
    "trees": make_pipeline(features, trees),
    "trees + friction": make_pipeline(friction, features, trees),
}
errors = {}
for name, model in models.items():
    predicted = cross_val_predict(model, X, y, cv=TrajectoryKFold(3))
    errors[name] = np.sqrt(np.mean((predicted - y) ** 2))
    print(f"{name:20s} {errors[name]:.3f} N m on trajectories left out")

# %%
# These columns are appended by the transformer.
print(FrictionTransformer(("viscous", "coulomb")).fit(X).get_feature_names_out()[-2:])

figure, axes = plt.subplots(figsize=(6, 2.5), layout="constrained")
axes.barh(list(errors), list(errors.values()))
axes.invert_yaxis()
axes.set(xlabel="held-out RMSE (N m)")
plt.show()
