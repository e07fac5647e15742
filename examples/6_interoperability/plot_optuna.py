# SPDX-License-Identifier: BSD-3-Clause
"""
Optuna chooses the filter and the friction
==========================================

`Optuna <https://optuna.org>`__ can search spaces that are too large for a grid: here the cut-off of
the derivatives on a continuous scale together with the effects of the model. Every trial is tested
on held-out trajectories.
"""

# %%
import sys

import matplotlib.pyplot as plt
from sklearn.model_selection import cross_val_score
from sklearn.pipeline import make_pipeline

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor
from skidyn.model_selection import TrajectoryKFold
from skidyn.preprocessing import SmoothDerivatives

try:
    import optuna
except ImportError:
    print("Optuna is not installed: pip install optuna")
    sys.exit(0)

log = make_hidden_effect_log(
    load_planar_arm(), "load_dependent_friction", joints=[1], n_trajectories=6, duration=6.0
)
X = log.frame[["time", "trajectory", "q1", "q2"]]
OPTIONAL = ("offset", "spring", "load_dependent_friction", "rotor_inertia")


def objective(trial):
    """Held-out error of one choice, N m."""
    chosen = [kind for kind in OPTIONAL if trial.suggest_categorical(kind, [False, True])]
    smooth = SmoothDerivatives(
        method="savitzky_golay", cutoff=trial.suggest_float("cutoff", 0.5, 30.0, log=True)
    )
    model = make_pipeline(
        smooth.set_output(transform="pandas"),
        RBDRegressor(log.robot, ("viscous", "coulomb", *chosen)),
    )
    scores = cross_val_score(
        model, X, log.y, cv=TrajectoryKFold(3), scoring="neg_root_mean_squared_error"
    )
    return -scores.mean()


optuna.logging.set_verbosity(optuna.logging.WARNING)
study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=0))
study.optimize(objective, n_trials=40)
print(f"best held-out RMSE {study.best_value:.4f} N m with {study.best_params}")

# %%
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
for used in (False, True):
    trials = [t for t in study.trials if t.params["load_dependent_friction"] == used]
    axes.plot(
        [t.params["cutoff"] for t in trials],
        [t.value for t in trials],
        "o",
        label=f"{'with' if used else 'without'} load-dependent friction",
    )
axes.set(xscale="log", yscale="log", xlabel="cut-off (Hz)", ylabel="held-out RMSE (N m)")
axes.legend()
plt.show()
