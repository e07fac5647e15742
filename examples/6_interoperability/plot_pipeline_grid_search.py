# SPDX-License-Identifier: BSD-3-Clause
"""
Pipeline and GridSearchCV: choose the filter together with the model
====================================================================

Only positions and torques were recorded. The amount of smoothing and the friction model are
parameters of one Pipeline, and scikit-learn's grid search selects both on whole trajectories.
"""

# %%
import matplotlib.pyplot as plt
import pandas as pd
from sklearn.model_selection import GridSearchCV
from sklearn.pipeline import Pipeline

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor
from skidyn.model_selection import TrajectoryKFold
from skidyn.preprocessing import SmoothDerivatives

log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=6, duration=6.0)
X = log.frame[["time", "trajectory", "q1", "q2"]]

pipeline = Pipeline(
    [
        ("derivatives", SmoothDerivatives(method="savitzky_golay").set_output(transform="pandas")),
        ("model", RBDRegressor(log.robot)),
    ]
)
search = GridSearchCV(
    pipeline,
    {
        "derivatives__cutoff": [1.0, 2.0, 4.0, 8.0, 16.0, None],
        "model__effects": [("viscous",), ("viscous", "coulomb")],
    },
    cv=TrajectoryKFold(3),
    scoring="neg_root_mean_squared_error",
).fit(X, log.y)

# %%
# With ``None`` the cut-off is found from the positions alone: it needs no grid and is close to the
# best.
print("best:", search.best_params_)
print(f"cut-off chosen from positions alone: {pipeline.fit(X, log.y)[0].cutoff_:.1f} Hz")
table = pd.DataFrame(search.cv_results_)
table["effects"] = table["param_model__effects"].map(" + ".join)
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
for name, rows in table.groupby("effects"):
    given = rows[rows["param_derivatives__cutoff"].notna()]
    own = rows[rows["param_derivatives__cutoff"].isna()]
    (line,) = axes.plot(
        given["param_derivatives__cutoff"].astype(float),
        -given["mean_test_score"],
        "o-",
        label=name,
    )
    axes.axhline(-own["mean_test_score"].item(), color=line.get_color(), ls=":")
axes.set(xlabel="cut-off (Hz); dotted: chosen from the data", ylabel="held-out RMSE (N m)")
axes.set(xscale="log", yscale="log")
axes.legend()
plt.show()
