# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis as the report sees it, made up without any fit."""

from dataclasses import dataclass, replace

import numpy as np

from skidyn.diagnosis import Comparison, Diagnosis, Finding, Limit
from skidyn.effects import Signals, Term
from skidyn.fleet import DriftReport, FleetComparison

HOSTILE = "<img src=x onerror=alert(1)>"
FLEET_COLUMNS = ("viscous.Fv[1]", "coulomb.Fc[2]")


def fake_signals(n_samples=3000, n_joints=3, rate=100.0, n_trajectories=3, prismatic=()):
    """Sines, a third of the samples in each trajectory; every trajectory starts at time 0."""
    per = n_samples // n_trajectories
    time = np.tile(np.arange(per) / rate, n_trajectories)
    trajectory = np.repeat(np.arange(n_trajectories), per)
    phase = 2 * np.pi * (0.1 + 0.07 * np.arange(n_joints)) * (1 + trajectory[:, None] / 3)
    arg = phase * time[:, None]
    slides = np.isin(np.arange(n_joints), prismatic)
    return Signals(
        q=np.sin(arg), dq=phase * np.cos(arg), ddq=-(phase**2) * np.sin(arg),
        trajectory=trajectory, time=time, prismatic=slides,
    )  # fmt: skip


def _comparison(signals, names, size, seed=0):
    """Measured torque with dry friction that the prediction lacks in part."""
    rng = np.random.default_rng(seed)
    smooth = 20 * np.sin(2 * signals.q) + 3 * signals.ddq
    friction = np.sign(signals.dq) * np.linspace(3.0, 0.3, signals.n_joints)
    measured = smooth + friction + rng.normal(scale=0.2, size=smooth.shape)
    predicted = smooth + (1 - size) * friction
    return Comparison(signals, measured, predicted, np.abs(signals.dq) > 0.05, tuple(names))


def _curve(joint, scale):
    x = np.linspace(-1.5, 1.5, 40)
    effect = scale * np.tanh(x / 0.1)
    measured = effect + 0.1 * np.sin(9 * x)
    return {
        "joint": joint, "variable": f"dq{joint}", "unit": "rad/s", "x": x, "effect": effect,
        "measured": measured, "low": measured - 0.3, "high": measured + 0.3,
    }  # fmt: skip


def _finding(joints, kind, title, drop, scale):
    several = len(joints) > 1
    values = [scale] * len(joints) if several else scale
    spread = [0.1] * len(joints) if several else 0.1
    return Finding(
        kind=kind, title=title, joints=tuple(joints),
        parameters={
            "Fc": {
                "value": values, "unit": "N m",
                "low": np.subtract(values, spread).tolist(),
                "high": np.add(values, spread).tolist(),
            },
        },
        variables=("dq1",), error_drop=drop, q_value=3e-7, rivals=("lugre", "stribeck"),
        separating_motion="slow sweeps with small reversals, below 0.02 rad",
        sentence=f"{title} on joint {joints[0]}. Adding it removes {drop:.0%} of the error.",
        code=f'model = diagnosis.add("{kind}", joints={list(joints)})',
        terms=(Term(kind, joints[:1]),), curves=[_curve(j, scale) for j in joints],
    )  # fmt: skip


@dataclass(repr=False)
class Fake(Diagnosis):
    """The shares of the error, which follow from a search, are stated."""

    budget: list | None = None


def make_diagnosis(verdict="missing", joint_names=("shoulder", "elbow", "slider"), n_samples=3000):
    """A diagnosis with two findings (none if ``verdict`` is ``"complete"``)."""
    n = len(joint_names)
    signals = fake_signals(n_samples, n, prismatic=(2,))
    complete = verdict == "complete"
    comparison = _comparison(signals, joint_names, 0.0 if complete else 1.0)
    after = _comparison(signals, joint_names, 0.02)
    history = [{"added": None, "joints": [], "rmse": comparison.rmse().tolist()}]
    findings = []
    if not complete:
        findings = [
            _finding([1, 2], "dahl", "Dahl friction", 0.62, 3.0),
            _finding([3], "spring", "Spring", 0.08, 0.6),
        ]
        middle = np.where(np.arange(n) < 2, after.rmse(), comparison.rmse())
        history.append({"added": "dahl", "joints": [1, 2], "rmse": middle.tolist()})
        history.append({"added": "spring", "joints": [3], "rmse": after.rmse().tolist()})
    unexplained = None
    if verdict == "unknown":
        title = "Something that depends on q1 and q3"
        findings[1] = replace(_finding([2], "unknown", title, 0.31, 0.6), variables=("q1", "q3"))
        history[2] = {**history[2], "added": "unknown", "joints": [2]}
        unexplained = {"joints": [2], "variables": ["q1", "q3"], "share": 0.31}
    limits = [
        Limit("torque_ripple", 1, 0.12, "N m", "torque ripple on joint 1: below 0.12 N m"),
        Limit("end_stop", 2, None, "N m", "an end stop on joint 2: this data cannot show it"),
    ]
    share = {"noise": 1.0} if complete else {"dahl": 0.6, "spring": 0.1, "noise": 0.3}
    return Fake(
        verdict=verdict, joint_names=tuple(joint_names), findings=findings, comparison=comparison,
        comparison_after=after, history=history, noise_floor=np.full(n, 0.2),
        unexplained=unexplained, limits=limits, warnings=["one trajectory has 3 repeated rows"],
        base_model=None, data=(), problem=None, result=None, budget=[dict(share) for _ in range(n)],
    )  # fmt: skip


def make_fleet(hostile="robot 8"):
    """Twenty robots, one of which deviates."""
    names = tuple(f"robot {k}" if k != 8 else hostile for k in range(1, 21))
    score = np.tile(np.linspace(-1.5, 1.5, 20)[:, None], (1, 2))
    score[7, 0] = 12.0
    q = np.where(score > 10, 1e-9, 0.9)
    common = {"viscous.Fv[1]": 1.0, "coulomb.Fc[2]": 2.0}
    return FleetComparison(names, FLEET_COLUMNS, common, 0.1 * score, score, q)


def make_drift():
    """A robot whose friction leaves its band."""
    value = np.array([[5.0], [5.1], [9.0]])
    low, high = np.array([[-np.inf], [4.0], [4.0]]), np.array([[np.inf], [6.0], [6.0]])
    return DriftReport(("coulomb.Fc[2]",), ("2 May", "3 May", "4 May"), value, low, high)
