# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis as a plain dictionary: all that the page shows, and nothing it has to compute."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._signals import Array, Signals
from skidyn._version import versions
from skidyn.report._decimate import rows_with_peaks
from skidyn.report._maps import residual_maps
from skidyn.report._plain import plain

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis

#: Buckets over the whole log; up to six rows of each bucket are drawn.
BUCKETS = 3000
#: Gap between pieces of a log on the axis of time, as a share of the whole.
GAP = 0.004
#: Share of what is left of a joint's squared error that is worth a word if it is predictable.
WORTH_A_WORD = 0.1


def summarize(
    diagnosis: Diagnosis,
    *,
    title: str | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Everything that the report page shows, as a dictionary of JSON values.

    Parameters
    ----------
    diagnosis : Diagnosis
        From :func:`skidyn.diagnosis.diagnose`.
    title : str, optional
        Heading of the page; the name of the robot by default.
    provenance : mapping, optional
        Where the numbers come from: files with their hashes, options. Versions are added.

    Returns
    -------
    summary : dict
        ``report`` is the machine-readable report (schema ``skidyn.diagnosis/1``); the rest is
        what the page draws beside it. Long signals are thinned without losing a peak. Errors are
        in N m, N for sliding joints.

    Examples
    --------
    >>> from skidyn.report import summarize
    >>> summary = summarize(diagnosis)  # doctest: +SKIP
    >>> summary["verdict_sentence"]  # doctest: +SKIP
    'Stribeck friction is missing on joint 2. ...'
    """
    signals = diagnosis.comparison.signals
    report = {**diagnosis.to_dict()}
    report["provenance"] = {"versions": versions(), **(provenance or {})}
    report["provenance"]["versions"].pop("executable", None)  # a path of this machine
    units = ["N" if slides else "N m" for slides in signals.prismatic]
    document: dict[str, Any] = plain(
        {
            "report": report,
            "title": title or getattr(signals.robot, "name", "") or "Robot inverse dynamics",
            "verdict_sentence": verdict_sentence(diagnosis),
            "units": units,
            "n_samples": signals.n_samples,
            "n_trajectories": len(np.unique(signals.trajectory)),
            "comparison": diagnosis.comparison.table(),
            "failures": [vars(failure) for failure in diagnosis.failures],
            "regimes": list(diagnosis.regimes),
            "error_map": diagnosis.error_map(),
            "findings": [
                {**finding.to_dict(), "title": finding.title, "code": finding.code,
                 "curves": finding.curves, "maps": residual_maps(diagnosis, finding)}
                for finding in diagnosis.findings
            ],
            "budget": diagnosis.budget,
            "left": predictable_left(diagnosis),
            "warnings": list(diagnosis.warnings),
            "traces": _traces(diagnosis),
        }
    )  # fmt: skip
    return document


def predictable_left(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Joints on which the motion still predicts part of the error, the largest share first."""
    after, floor = np.asarray(diagnosis.rmse_after), np.asarray(diagnosis.noise_floor)
    shares = 1 - (floor / np.maximum(after, 1e-300)) ** 2
    rows = [
        {"joint": j + 1, "share": float(share)}
        for j, share in enumerate(shares)
        if share >= WORTH_A_WORD  # false for NaN
    ]
    return sorted(rows, key=lambda row: -row["share"])


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """The outcome in one or two sentences."""
    left = predictable_left(diagnosis)
    if not diagnosis.findings and left:
        return (
            "No effect stands out enough to be called missing, but the error is not all noise: on "
            f"{_joints(sorted(row['joint'] for row in left))} part of it can be predicted from "
            "the motion."
        )
    if not diagnosis.findings:
        return (
            "Nothing significant is missing: what is left of the error looks like noise in this "
            "data."
        )
    named = [f for f in diagnosis.findings if f.kind != "unknown"]
    parts = [f"{f.title} ({_joints(f.joints)}{_rivals(f.rivals)})" for f in named]
    text = ""
    if parts:
        text = f"{_and(parts)} {'is' if len(parts) == 1 else 'are'} missing."
    if diagnosis.unexplained:
        where = _joints(diagnosis.unexplained["joints"])
        variables = _and(list(diagnosis.unexplained["variables"]))
        also = " also" if parts else ""
        text += (
            f" Something that depends on {variables} is{also} missing on {where}; no effect of "
            "the catalogue explains it."
        )
    before, after = np.asarray(diagnosis.rmse_before), np.asarray(diagnosis.rmse_after)
    ratio = after[before > 0] / before[before > 0]
    if len(ratio):
        # joints have different units and scales, so the mean is one of ratios
        what = "it" if len(diagnosis.findings) == 1 else "them"
        drop = 1 - math.exp(np.log(np.maximum(ratio, 1e-12)).mean())
        if drop < 0.005:
            text += f" Adding {what} hardly changes the held-out error in the mean over joints."
        else:
            text += (
                f" Adding {what} lowers the held-out error by {drop:.0%} in the mean over joints."
            )
    return text.strip()


def _joints(joints: Any) -> str:
    numbers = [str(j) for j in joints]
    return f"joint {numbers[0]}" if len(numbers) == 1 else f"joints {_and(numbers)}"


def _rivals(kinds: Any) -> str:
    """A name that the data do not settle is not said without its rivals."""
    return f"; or {', '.join(kind.replace('_', ' ') for kind in kinds)}" if kinds else ""


def _and(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def _traces(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Measured and modelled torque over time for each joint, trajectories laid end to end."""
    comparison, after = diagnosis.comparison, diagnosis.comparison_after
    signals = comparison.signals
    clock, starts = elapsed(signals)
    traces = []
    for j in range(signals.n_joints):
        measured, before = comparison.measured[:, j], comparison.predicted[:, j]
        pieces = rows_with_peaks(
            [measured, measured - before, measured - after.predicted[:, j]],
            signals.segments,
            BUCKETS,
        )
        rows = np.concatenate(pieces)
        traces.append(
            {
                "time": np.round(clock[rows], 5),
                "measured": measured[rows],
                "before": before[rows],
                "after": after.predicted[rows, j],
                # where a line must not be drawn on from the previous row
                "breaks": np.cumsum([len(piece) for piece in pieces])[:-1],
                "starts": starts,
            }
        )
    return traces


def elapsed(signals: Signals) -> tuple[Array, list[dict[str, Any]]]:
    """Time that runs on over the borders of trajectories, with a gap that the eye sees.

    Parameters
    ----------
    signals : Signals
        Motion.

    Returns
    -------
    clock : ndarray of shape (n_samples,), s
        Time on the axis.
    starts : list of dict
        ``trajectory`` and ``time``, s, of each beginning.
    """
    pieces = [signals.clock[segment] for segment in signals.segments]
    total = sum(float(piece[-1] - piece[0]) for piece in pieces)
    gap = min(GAP * total, 0.1 * total / len(pieces))
    clock = np.empty(signals.n_samples)
    starts: list[dict[str, Any]] = []
    end = 0.0
    for segment, time in zip(signals.segments, pieces, strict=True):
        clock[segment] = time - time[0] + end
        name = int(signals.trajectory[segment.start])
        if not starts or starts[-1]["trajectory"] != name:
            starts.append({"trajectory": name, "time": end})
        end = float(clock[segment.stop - 1]) + gap
    return clock, starts
