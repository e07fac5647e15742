# SPDX-License-Identifier: BSD-3-Clause
"""Dynamics and networks on a GPU and on a CPU: times, and differences of the results.

Usage: python benchmarks/engine/devices.py [--samples 100000] [--devices cpu cuda]

Inverse dynamics and regressor of the Panda in float64 and float32, microseconds per sample, and the
same with the NumPy engine; then the fit of an NDLRegressor on a simulated log, seconds. Times are
the smallest of five, after a first call that is not counted, with the device synchronised before
and after.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial

import numpy as np
import torch

from skidyn.datasets import load_panda, make_hidden_effect_log
from skidyn.neural_network import NDLRegressor


def least(function: Callable[[], object], device: str, repeats: int = 5) -> float:
    """Least seconds of a call."""
    times = []
    for _ in range(repeats + 1):
        if device.startswith("cuda"):
            torch.cuda.synchronize()
        start = time.perf_counter()
        function()
        if device.startswith("cuda"):
            torch.cuda.synchronize()
        times.append(time.perf_counter() - start)
    return min(times[1:])


def dynamics(samples: int, devices: list[str]) -> None:
    """Print the table of inverse dynamics and regressor."""
    robot = load_panda()
    motion = np.random.default_rng(0).uniform(-1.5, 1.5, (3, samples, robot.n_joints))
    exact = robot.inverse_dynamics(*motion)
    print(f"{'us per sample':<24}{'torque':>9}{'regressor':>11}{'largest error, N m':>20}")

    def row(name: str, torque: float, regressor: float, error: float) -> None:
        scale = 1e6 / samples
        print(f"{name:<24}{torque * scale:9.3f}{regressor * scale:11.3f}{error:20.1e}", flush=True)

    row(
        "numpy, float64",
        least(lambda: robot.inverse_dynamics(*motion), "cpu"),
        least(lambda: robot.torque_regressor(*motion), "cpu"),
        0.0,
    )
    for device in devices:
        for dtype in (torch.float64, torch.float32):
            tensors = torch.tensor(motion, dtype=dtype, device=device)
            torque = partial(robot.inverse_dynamics_torch, *tensors)
            regressor = partial(robot.torque_regressor_torch, *tensors)
            with torch.no_grad():
                error = float(np.abs(torque().cpu().numpy() - exact).max())
                name = f"torch, {device}, {str(dtype).removeprefix('torch.')}"
                row(name, least(torque, device), least(regressor, device), error)


def networks(devices: list[str]) -> None:
    """Print the seconds of a fit, and the error of its predictions on each device."""
    log = make_hidden_effect_log(load_panda(), "stribeck", n_trajectories=6)
    test = np.asarray(log.X["trajectory"]) == 6
    print(f"{'NDLRegressor':<24}{'fit, s':>9}{'held-out error, N m':>20}")
    for device in devices:
        model = NDLRegressor(device=device, random_state=0)
        start = time.perf_counter()
        model.fit(log.X[~test], log.y[~test])
        seconds = time.perf_counter() - start
        error = np.sqrt(np.mean((model.predict(log.X[test]) - np.asarray(log.y[test])) ** 2))
        print(f"{device:<24}{seconds:9.1f}{error:20.3f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=100_000)
    here = ["cpu", *(["cuda"] if torch.cuda.is_available() else [])]
    parser.add_argument("--devices", nargs="+", default=here, help="default: those of this machine")
    parser.add_argument("--skip-networks", action="store_true")
    options = parser.parse_args()
    dynamics(options.samples, options.devices)
    if not options.skip_networks:
        networks(options.devices)


if __name__ == "__main__":
    main()
