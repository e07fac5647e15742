# SPDX-License-Identifier: BSD-3-Clause
"""Sensors and logger for a simulated motion, and the truth about the log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.suite._hidden import Hidden
from skidyn.datasets.suite._plant import STEP, rigid_columns
from skidyn.datasets.suite._simulate import Recording

#: Torque noise relative to the largest torque; share of it that is coloured, and its time in s.
LEVEL = {"low": (0.004, 0.007), "high": (0.018, 0.028)}
COLOURED, COLOUR_TIME = {"low": 0.0, "high": 0.4}, 0.03
#: Number of standard errors from which an effect counts as detectable.
DETECTABLE = 12.0


@dataclass(frozen=True)
class Sensors:
    """Settings of the logger."""

    rate: float
    noise: str
    irregular: bool
    jitter: float
    bits: int
    velocity: str
    acceleration: bool
    temperature: bool


def sample(
    recordings: Sequence[Recording],
    sensors: Sensors,
    delay: dict[int, float],
    rng: np.random.Generator,
) -> dict[str, Array]:
    """Rows of the log without noise, as from perfect sensors."""
    parts: dict[str, list[Array]] = {
        name: [] for name in ("time", "trajectory", "q", "dq", "ddq", "tau", "temperature")
    }
    for g, run in enumerate(recordings):
        stride = 1 / (sensors.rate * STEP)
        rows = np.arange(int(len(run.clock) / stride)) * stride
        if sensors.irregular:
            rows = rows + rng.normal(0, 0.12 * stride, len(rows))
        rows = np.unique(np.clip(np.round(rows).astype(int), 0, len(run.clock) - 1))
        if sensors.irregular:
            kept = rng.random(len(rows)) > 0.01
            for start in rng.integers(0, len(rows), 2):
                kept[start : start + rng.integers(3, 12)] = False
            rows = rows[kept]
        whole, first = np.vstack([run.before, run.tau]), len(run.before)
        tau = run.tau[rows]
        for j, lag in delay.items():
            tau[:, j] = whole[first + rows - round(lag / STEP), j]
        values = (run.clock, None, run.q, run.dq, run.ddq, None, run.temperature)
        for name, value in zip(parts, values, strict=True):
            if value is not None:
                parts[name].append(value[rows])
        parts["tau"].append(tau)
        parts["trajectory"].append(np.full(len(rows), g + 1))
    return {name: np.concatenate(values) for name, values in parts.items()}


def measure(
    rows: dict[str, Array],
    sensors: Sensors,
    noise_std: Array,
    sliders: Array,
    rng: np.random.Generator,
) -> dict[str, Array]:
    """Columns of the log, with noise, steps of encoders and converters, and jitter of the clock."""
    n = rows["q"].shape[1]
    step = np.where(sliders, 1e-6 * 2.0 ** (20 - sensors.bits), 2 * np.pi / 2**sensors.bits)
    q = np.round(rows["q"] / step) * step
    time = np.round(rows["time"] + sensors.jitter * rng.standard_normal(len(q)), 4)
    runs = [np.flatnonzero(rows["trajectory"] == g) for g in np.unique(rows["trajectory"])]
    if sensors.velocity == "differences":
        dq = np.vstack([np.gradient(q[r], rows["time"][r], axis=0) for r in runs])
    else:
        share = {"low": 0.002, "high": 0.006}[sensors.noise]
        dq = rows["dq"] + share * np.abs(rows["dq"]).max(axis=0) * rng.standard_normal(q.shape)
    tau = rows["tau"] + noise_std * np.vstack([_noise(len(r), n, sensors, rng) for r in runs])
    converter = 2.0 ** np.floor(np.log2(noise_std / 6))
    tau = np.round(tau / converter) * converter
    out: dict[str, Array] = {"time": time, "trajectory": rows["trajectory"].astype(np.int16)}
    channels = {"q": q, "dq": dq}
    if sensors.acceleration:
        noise = 0.03 * rows["ddq"].std(axis=0)
        channels["ddq"] = rows["ddq"] + noise * rng.standard_normal(q.shape)
    channels["tau"] = tau
    if sensors.temperature:
        warm = rows["temperature"] + 0.15 * rng.standard_normal(q.shape)
        channels["temp"] = np.round(4 * warm) / 4
    for name, values in channels.items():
        for j in range(n):
            out[f"{name}{j + 1}"] = values[:, j]
    return out


def _noise(length: int, n: int, sensors: Sensors, rng: np.random.Generator) -> Array:
    """Noise of unit size, partly coloured."""
    white, share = rng.standard_normal((length, n)), COLOURED[sensors.noise]
    if not share:
        return white
    keep = np.exp(-1 / (sensors.rate * COLOUR_TIME))
    colour, state = np.empty((length, n)), rng.standard_normal(n)
    for i in range(length):
        state = keep * state + np.sqrt(1 - keep**2) * rng.standard_normal(n)
        colour[i] = state
    return np.asarray(np.sqrt(1 - share) * white + np.sqrt(share) * colour)


def left_by_base(
    robot: str, rows: dict[str, Array], base: Sequence[str], noise_std: Array, sliders: Array
) -> tuple[Array, Array]:
    """RMS residual of the refitted base model on the noise-free log, per joint.

    Rows at rest are left out, because dry friction there is not a function of the motion. Also
    returns the share of such rows.
    """
    every = max(1, len(rows["q"]) // 700)
    q, dq, ddq, tau = (rows[name][::every] for name in ("q", "dq", "ddq", "tau"))
    n = q.shape[1]
    columns = rigid_columns(robot, q, dq, ddq)
    extra = {"viscous": dq, "coulomb": np.sign(dq), "rotor_inertia": ddq}
    own = [values[:, :, None] * np.eye(n) for name, values in extra.items() if name in base]
    columns = np.concatenate([columns, *own], axis=2)
    moves = np.abs(dq) > np.where(sliders, 1e-3, 1e-2)
    weight = np.where(moves, 1 / noise_std, 0.0)
    matrix = (columns * weight[..., None]).reshape(-1, columns.shape[2])
    size = np.maximum(np.linalg.norm(matrix, axis=0), 1e-12)
    target = (tau * weight).ravel()
    fit = np.linalg.lstsq(matrix / size, target, rcond=1e-9)[0]
    left = (target - matrix / size @ fit).reshape(-1, n) * noise_std
    return np.sqrt((left**2).mean(axis=0)), 1 - moves.mean(axis=0)


def truth_of(
    hidden: Sequence[Hidden], left: Array, noise_std: Array, n_rows: int, sensors: Sensors
) -> dict[str, Any]:
    """Effects, and their sizes relative to the noise."""
    share, keep = COLOURED[sensors.noise], np.exp(-1 / (sensors.rate * COLOUR_TIME))
    inflation = 1 - share + share * (1 + keep) / (1 - keep)
    ratio = left / noise_std
    z = ratio * np.sqrt(n_rows / inflation)
    joints = {j for item in hidden for j in item.joints}
    return {
        "effects": [item.truth() for item in hidden],
        "noise_std": noise_std.tolist(),
        "left_over_noise": ratio.tolist(),
        "standard_errors": z.tolist(),
        "detectable": bool(hidden) and bool(z.max() > DETECTABLE),
        "joints_required": sorted(j + 1 for j in joints if z[j] > DETECTABLE),
    }
