# SPDX-License-Identifier: BSD-3-Clause
"""Two diagnoses side by side, as a plain dictionary: two models of one log, or two recordings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._plain import plain
from skidyn._text import digits, inside, joints_told, listed
from skidyn._version import versions
from skidyn.report._heat import judged_regimes
from skidyn.report._parameters import parameter_rows
from skidyn.report._picture import read_all

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from skidyn._signals import Array
    from skidyn.diagnosis import Diagnosis, Finding

#: Errors whose ratio differs from one by less than this are treated as equal.
ALIKE = 0.1
#: Half the width of a 95 % interval in standard errors.
NORMAL = 1.96


@dataclass(frozen=True)
class Pair:
    """Two diagnoses of robots with the same joints, and the ``report`` of their comparison."""

    diagnoses: tuple[Diagnosis, Diagnosis]
    report: dict[str, Any]


def summarize_comparison(
    first: Diagnosis,
    second: Diagnosis,
    *,
    names: Sequence[str] = ("first", "second"),
    title: str | None = None,
    provenance: Sequence[Mapping[str, Any]] = ({}, {}),
) -> dict[str, Any]:
    """Compare two diagnoses: two models of one log, or one model on two recordings.

    Parameters
    ----------
    first, second : Diagnosis
        From :func:`skidyn.diagnosis.diagnose`, of robots with the same joints.
    names : sequence of two str, default=("first", "second")
        Names of the two.
    title : str, optional
        Heading of the page; the name of the robot by default.
    provenance : sequence of two mappings, optional
        Provenance of each. Versions are added.

    Returns
    -------
    summary : dict
        ``report`` is machine-readable (schema ``skidyn.comparison/1``): errors per joint and
        regime, findings and coefficients of both with 95 % intervals; the rest is the data of the
        figures. Errors are in N m, N for sliding joints.

    Raises
    ------
    SkidynError
        The joints of the two differ, or there are not two different names.

    Examples
    --------
    >>> from skidyn.report import summarize_comparison
    >>> summary = summarize_comparison(new, worn, names=("new", "worn"))  # doctest: +SKIP
    >>> summary["report"]["findings"]  # doctest: +SKIP
    [{'kinds': ['coulomb'], 'joint': 2, 'in': ['worn'], ...}]
    """
    labels = [str(name) for name in names]
    if len(labels) != 2 or labels[0] == labels[1]:
        raise SkidynError(f"a comparison needs two different names, got {labels}")
    both = (first, second)
    if first.joint_names != second.joint_names:
        raise SkidynError(
            f"{labels[0]} has the joints {', '.join(first.joint_names)}, {labels[1]} has "
            f"{', '.join(second.joint_names)}; only diagnoses of the same joints can be compared"
        )
    same = np.array_equal(first.comparison.measured, second.comparison.measured)
    signals = first.comparison.signals
    report = {
        "schema": "skidyn.comparison/1",
        "names": labels,
        "joints": list(first.joint_names),
        "units": first.comparison.units,
        "same_log": same,
        "regimes": list(first.regimes),
        "sides": [
            _side(d, name, source) for d, name, source in zip(both, labels, provenance, strict=True)
        ],
        "ratios": _ratios(first, second, same),
        "findings": _findings(both, labels),
        "coefficients": _coefficients(both, same),
        "versions": versions(),
    }
    document: dict[str, Any] = plain(
        {
            "report": report,
            "title": title or getattr(signals.robot, "name", "") or "Robot inverse dynamics",
            "headline": _headline(report),
            "sentence": _sentence(report),
            "joints": _rows(both, report),
            **read_all("comparison", Pair(both, report)),
        }
    )
    return document


def _side(diagnosis: Diagnosis, name: str, provenance: Mapping[str, Any]) -> dict[str, Any]:
    comparison, told = diagnosis.comparison, diagnosis.story()
    torque = np.sqrt(np.mean(comparison.measured**2, axis=0))
    return {
        "name": name,
        "verdict": diagnosis.verdict,
        "sentence": f"{told['headline']}. {told['left']}",
        "n_samples": comparison.signals.n_samples,
        "n_trajectories": len(np.unique(comparison.signals.trajectory)),
        "rms_torque": torque,
        "rmse_before": diagnosis.rmse_before,
        "rmse_after": diagnosis.rmse_after,
        "noise": diagnosis.noise,
        "error_map": diagnosis.error_map(),
        "judged": judged_regimes(diagnosis),
        "warnings": list(diagnosis.warnings),
        "provenance": dict(provenance),
    }


def _ratios(first: Diagnosis, second: Diagnosis, same: bool) -> list[dict[str, Any]]:
    """Error of the second over the first, as given; an interval where the log is the same."""
    from skidyn.metrics import paired_comparison  # not needed to write a page

    rows = []
    for j in range(len(first.joint_names)):
        before = first.rmse_before[j]
        ratio = second.rmse_before[j] / before if before > 0 else np.nan
        row = {"joint": j + 1, "ratio": ratio, "low": None, "high": None}
        if same:
            one, other = (_errors(d, j) for d in (first, second))
            if len(one) > 1 and (one > 0).all() and (other > 0).all():
                paired = paired_comparison(one[:, None], other[:, None])
                row.update(ratio=paired.ratio, low=paired.low, high=paired.high)
        rows.append(row)
    return rows


def _errors(diagnosis: Diagnosis, joint: int) -> Array:
    """Mean squared error of every trajectory while the joint slides, (N m)^2 or N^2."""
    from skidyn.metrics import trajectory_errors  # not needed to write a page

    c = diagnosis.comparison
    use = c.sliding[:, joint]
    _, errors = trajectory_errors(
        c.measured[use, joint], c.predicted[use, joint], c.signals.trajectory[use]
    )
    return errors[:, 0]


def _findings(both: Sequence[Diagnosis], names: Sequence[str]) -> list[dict[str, Any]]:
    """One row per kind and joint, with the parameters in each of the two.

    Kinds that one of the logs cannot separate share a row, since they are one effect with two
    names.
    """
    rows: list[dict[str, Any]] = []
    for side, (diagnosis, name) in enumerate(zip(both, names, strict=True)):
        for finding, card in zip(diagnosis.findings, diagnosis.story()["cards"], strict=True):
            told = plain(finding.to_dict())
            parameters = parameter_rows(told)
            for joint in finding.joints:
                row = _row(rows, finding, joint)
                if name in row["in"]:
                    continue
                row["in"].append(name)
                row["uncertain"] &= card["guess"]
                row["confidence"][side] = told.get("confidence")
                row["titles"][side] = finding.title
                row["error_drop"][side] = finding.error_drop
                row["parameters"][side] = [p for p in parameters if p["joint"] in (joint, "–")]
    return sorted(rows, key=lambda row: (len(row["in"]), row["kinds"], row["joint"]))


def _row(rows: list[dict[str, Any]], finding: Finding, joint: int) -> dict[str, Any]:
    """The row of a finding on a joint; a new one if neither it nor a rival has one."""
    for row in rows:
        if row["joint"] != joint:
            continue
        if finding.kind in (*row["kinds"], *row["rivals"]) or set(row["kinds"]) & {*finding.rivals}:
            row["kinds"] = list(dict.fromkeys([*row["kinds"], finding.kind]))
            return row
    rows.append(
        {"kinds": [finding.kind], "rivals": list(finding.rivals), "joint": joint, "in": [],
         "uncertain": True, "confidence": [None, None], "titles": [None, None],
         "error_drop": [None, None], "parameters": [[], []]}
    )  # fmt: skip
    return rows[-1]


def _coefficients(both: Sequence[Diagnosis], same: bool) -> list[dict[str, Any]]:
    """Coefficients of the given models, fitted to all data, with 95 % intervals.

    On two logs the estimates are independent, so that a difference can be tested.
    """
    first, second = both
    tables = [_table(first)]
    tables.append(tables[0] if second is first else _table(second))
    rows = []
    for name in dict.fromkeys([*tables[0], *tables[1]]):
        sides = [table.get(name) for table in tables]
        known = [side for side in sides if side is not None]
        differs = None
        if len(known) == 2 and not same:
            gap = known[0]["value"] - known[1]["value"]
            differs = bool(abs(gap) > NORMAL * np.hypot(known[0]["std"], known[1]["std"]))
        rows.append({"name": name, "sides": sides, "differs": differs})
    # effects first: their names are short and their numbers have a direct meaning
    return sorted(rows, key=lambda row: "[" not in row["name"])


def _table(diagnosis: Diagnosis) -> dict[str, dict[str, float]]:
    model = diagnosis.base_model
    if not hasattr(model, "with_effects"):
        return {}  # a regressor without physics has no named coefficients
    fitted = model.with_effects(()).fit(*diagnosis.data)
    return {
        row["name"]: {
            "value": row["value"],
            "std": row["std"],
            "low": row["value"] - NORMAL * row["std"],
            "high": row["value"] + NORMAL * row["std"],
        }
        for row in fitted.parameter_table()
    }


def _rows(both: Sequence[Diagnosis], report: dict[str, Any]) -> list[dict[str, Any]]:
    """One row per joint with the errors of both; joints that differ or fail are shown."""
    rows = []
    for row, other, change in zip(
        *(d.story()["joints"] for d in both), report["ratios"], strict=True
    ):
        errors = [row["before"], other["before"]]
        ratio = change["ratio"]
        differs = bool(np.isfinite(ratio)) and not 1 / (1 + ALIKE) < ratio < 1 + ALIKE
        noises = [digits(side["noise"]) for side in (row, other)]
        noise = noises[0] if noises[0] == noises[1] else " and ".join(noises)
        rows.append(
            {
                "joint": row["joint"],
                "name": row["name"],
                "before": errors[0],
                "after": errors[1],
                "ratios": [row["ratios"][0], other["ratios"][0]],
                "state": "differs" if differs else "alike",
                "speaks": differs or row["speaks"] or other["speaks"],
                "text": f"{digits(errors[0])} against {digits(errors[1])} {row['unit']} "
                f"(noise {noise})",
            }
        )
    return rows


def _headline(report: dict[str, Any]) -> str:
    """The outcome in a few words: effects missing in only one of the two, or the error ratio."""
    names = report["names"]
    parts = []
    for name in names:
        own = [row for row in report["findings"] if row["in"] == [name]]
        if own:
            parts.append(f"missing only in “{name}”: {_brief(own)}")
    if parts:
        return "; ".join(parts).replace("missing", "Missing", 1)
    mean = _mean_ratio(report)
    if report["same_log"] and mean is not None and abs(mean - 1) >= ALIKE:
        best = names[0] if mean > 1 else names[1]
        return f"“{best}” has the smaller error"
    if report["findings"]:
        certain = any(not row["uncertain"] for row in report["findings"])
        return f"The same effects {'are' if certain else 'may be'} missing in both"
    return "No effect is missing in either"


def _brief(rows: Sequence[dict[str, Any]]) -> str:
    """Effects with their joints; those that are uncertain in both recordings last."""
    joints: dict[str, list[int]] = {}
    for row in sorted(rows, key=lambda row: row["uncertain"]):
        title = next(filter(None, row["titles"])).partition(", best described by ")[0]
        name = f"{'possibly ' if row['uncertain'] else ''}{inside(title)}"
        joints.setdefault(name, []).append(row["joint"])
    return listed([f"{title} on {joints_told(sorted(on))}" for title, on in joints.items()])


def _mean_ratio(report: dict[str, Any]) -> float | None:
    """Geometric mean over joints of the error of the second over that of the first."""
    ratios = np.array([row["ratio"] for row in report["ratios"]], dtype=float)
    good = ratios[np.isfinite(ratios) & (ratios > 0)]
    return float(np.exp(np.log(good).mean())) if len(good) else None


def _sentence(report: dict[str, Any]) -> str:
    """The outcome in two or three sentences."""
    first, second = (f"“{name}”" for name in report["names"])
    mean = _mean_ratio(report)
    text = (
        "These are two models of the same recording. "
        if report["same_log"]
        else "These are two different recordings. "
    )
    if mean is not None:
        less = sum(row["ratio"] < 1 for row in report["ratios"])
        over = (
            f" in the mean over joints; its error is smaller on {less or 'none'} of "
            f"{len(report['ratios'])} joints"
        )
        several = len(report["ratios"]) > 1
        text += f"As given, {second} has {_change(mean, first)}{over if several else ''}. "
    shared = [row for row in report["findings"] if len(row["in"]) == 2]
    return (text + (f"Missing in both: {_brief(shared)}." if shared else "")).rstrip()


def _change(ratio: float, first: str) -> str:
    if abs(ratio - 1) < 0.005:
        return f"the same held-out error as {first}"
    size = "smaller" if ratio < 1 else "larger"
    return f"a held-out error {abs(ratio - 1):.0%} {size} than {first}"
