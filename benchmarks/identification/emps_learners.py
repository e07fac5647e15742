# SPDX-License-Identifier: BSD-3-Clause
"""Free run of the EMPS benchmark by learners: alone, and on what physics leaves.

Recordings, split and metric are those of ``emps_simulation.py``. Three learners are fitted to the
first recording and run through the second from its first sample and the force alone:

- the acceleration as a network's function of position, velocity and force, integrated twice;
- the velocity as a recurrent network's function of the force (:class:`LSTMRegressor`), integrated;
- the force that a fitted :class:`RBDRegressor` leaves, as a network's function of position and
  velocity, which acts beside the model: the residual of least squares and of output error.

Every network is trained with five seeds, and the middle one of the five errors is printed with the
smallest and the largest.

    python benchmarks/identification/emps_learners.py FOLDER
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from skidyn.evidence import smooth_motion
from skidyn.identification import RBDRegressor
from skidyn.neural_network import LSTMRegressor
from skidyn.robots import Robot

sys.path.insert(0, str(Path(__file__).parent))
from emps_simulation import SKIPPED, SYMMETRIC, URDF, read

SEEDS = 5
#: Every so many samples one is shown to a network.
THINNED = 10


def motion_of(frame):
    """Position, velocity and acceleration of a recording, smoothed."""
    from skidyn._signals import Signals

    q = frame["q1"].to_numpy()[:, None]
    dq, time = frame["dq1"].to_numpy()[:, None], frame["time"].to_numpy()
    signals = Signals(q, dq, 0 * q, np.zeros(len(q), int), time)
    smooth = smooth_motion(signals)
    return smooth.q[:, 0], smooth.dq[:, 0], smooth.ddq[:, 0]


def network(seed):
    """A network of two layers behind scaled inputs and before a scaled output."""
    net = MLPRegressor(
        hidden_layer_sizes=(32, 32),
        alpha=1e-3,
        max_iter=300,
        early_stopping=True,
        random_state=seed,
    )
    return make_pipeline(StandardScaler(), net)


def free_run(frame, force, acceleration):
    """Positions from the first sample on, by steps of the log."""
    q, dq = float(frame["q1"].iloc[0]), float(frame["dq1"].iloc[0])
    step = float(np.median(np.diff(frame["time"])))
    found = np.empty(len(frame))
    for k, f in enumerate(force):
        found[k] = q
        dq = acceleration(q, dq, f, step)
        q += step * dq
        if abs(q) > 10:
            found[k:] = 10.0
            break
    return found


def layers(pipeline, size):
    """The network as plain arrays: one sample through scikit-learn takes a hundred times longer."""
    scaler, net = pipeline.steps[0][1], pipeline.steps[1][1]

    def evaluate(*x):
        h = (np.array(x) - scaler.mean_) / scaler.scale_
        for weight, bias in zip(net.coefs_[:-1], net.intercepts_[:-1], strict=True):
            h = np.maximum(h @ weight + bias, 0.0)

        return size * float((h @ net.coefs_[-1] + net.intercepts_[-1])[0])

    return evaluate


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    X, y = read(options.folder / "DATA_EMPS.mat")
    X_test, y_test = read(options.folder / "DATA_EMPS_PULSES.mat")
    q, dq, ddq = motion_of(X)
    rows = np.arange(0, len(q), THINNED)
    truth = X_test["q1"].to_numpy()

    def told(name, runs):
        errors = [1e3 * np.sqrt(np.mean((run - truth)[SKIPPED:] ** 2)) for run in runs]
        low, middle, high = np.quantile(errors, (0, 0.5, 1))
        print(f"{name:46s} {middle:8.2f} {low:8.2f} {high:8.2f}", flush=True)

    print(f"{'free run, mm':46s} {'middle':>8s} {'least':>8s} {'most':>8s}")
    for estimator in ("weighted", "output_error"):
        model = RBDRegressor(
            Robot.from_urdf(URDF), SYMMETRIC, estimator=estimator, horizon=None
        ).fit(X, y)
        sizes = {t.kind: float(c[0]) for t, c in model.effect_coefficients_.items()}
        mass = float(model.inertial_parameters_[0, 0])
        left = y - (mass * ddq + sizes["viscous"] * dq + sizes["coulomb"] * np.sign(dq))
        left -= sizes["offset"]

        def beside(learned, mass=mass, sizes=sizes):
            def acceleration(q, dq, force, step):
                push = mass * dq + step * (force - sizes["offset"] - learned(q, dq))
                held = np.sign(push) * max(abs(push) - step * sizes["coulomb"], 0.0)
                return held / (mass + step * sizes["viscous"])

            return acceleration

        told(f"physics, {estimator}", [free_run(X_test, y_test, beside(lambda q, dq: 0.0))])
        runs = []
        for seed in range(SEEDS):
            net = network(seed).fit(np.column_stack([q, dq])[rows], left[rows] / left.std())
            runs.append(free_run(X_test, y_test, beside(layers(net, left.std()))))
        told(f"physics, {estimator}, and a network beside it", runs)
    runs = []
    for seed in range(SEEDS):
        net = network(seed).fit(np.column_stack([q, dq, y])[rows], ddq[rows] / ddq.std())
        learned = layers(net, ddq.std())
        runs.append(free_run(X_test, y_test, lambda q, dq, f, h, g=learned: dq + h * g(q, dq, f)))
    told("network of the acceleration", runs)
    slow, step = slice(None, None, THINNED), THINNED * float(np.median(np.diff(X["time"])))
    runs = []
    for seed in range(SEEDS):
        lstm = LSTMRegressor(window=100, max_epochs=60, random_state=seed)
        lstm.fit(y[slow, None] / y.std(), dq[slow] / dq.std())
        speed = dq.std() * np.ravel(lstm.predict(y_test[slow, None] / y.std()))
        way = truth[0] + np.r_[0.0, np.cumsum(step * speed)[:-1]]
        runs.append(np.interp(X_test["time"], X_test["time"].to_numpy()[slow], way))
    told("LSTM of the velocity", runs)


if __name__ == "__main__":
    main()
