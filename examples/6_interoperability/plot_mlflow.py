# SPDX-License-Identifier: BSD-3-Clause
"""
Runs and models in MLflow
=========================

A skidyn model is a scikit-learn model, so MLflow's scikit-learn flavour stores it. The held-out
error of every step of the diagnosis becomes a metric, the report an artifact.
"""

# %%
import logging
import os
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.report import summarize, write_html

os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")  # nothing leaves this machine
try:
    import mlflow
except ImportError:
    print("MLflow is not installed: pip install mlflow-skinny")
    sys.exit(0)

logging.getLogger("mlflow").setLevel(logging.ERROR)
log = make_hidden_effect_log(load_planar_arm(), "stribeck", joints=[2])
diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)

# %%
# This is one run. ``skops`` is MLflow's safe format; ``cloudpickle`` stores classes of a script
# too.
folder = Path(tempfile.mkdtemp())
mlflow.set_tracking_uri(f"sqlite:///{folder / 'runs.db'}")
mlflow.create_experiment("planar arm", artifact_location=(folder / "artifacts").as_uri())
mlflow.set_experiment("planar arm")
with mlflow.start_run(run_name="find what is missing") as run:
    mlflow.log_params({"robot": log.robot.name, "verdict": diagnosis.verdict})
    for step, entry in enumerate(diagnosis.history):
        mlflow.log_metric("held_out_rmse", float(np.mean(entry["rmse"])), step=step)
    mlflow.log_artifact(str(write_html(folder / "report.html", summarize(diagnosis))))
    stored = mlflow.sklearn.log_model(
        diagnosis.model, name="model", serialization_format="cloudpickle"
    )

# %%
# Later the model can be loaded from the run and used for prediction.
loaded = mlflow.sklearn.load_model(stored.model_uri)
print("same prediction:", np.array_equal(loaded.predict(log.X), diagnosis.model.predict(log.X)))
history = mlflow.tracking.MlflowClient().get_metric_history(run.info.run_id, "held_out_rmse")
for point in history:
    print(f"step {point.step}: held-out RMSE {point.value:.4f} N m")

# %%
# The picture shows that the error decreases with every added effect.
steps = ["as given", *(f"+ {entry['added']}" for entry in diagnosis.history[1:])]
fig, ax = plt.subplots(figsize=(6, 3.4), layout="constrained")
ax.bar(steps, [point.value for point in history])
ax.set(ylabel="held_out_rmse of the run (N m)")
plt.show()
