# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis as a plain dictionary: all that the page shows, and nothing it has to compute."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._plain import plain
from skidyn._text import joints_told, listed
from skidyn._version import versions
from skidyn.diagnosis import regimes, sure
from skidyn.effects import get_effect
from skidyn.report._maps import residual_maps
from skidyn.report._traces import traces

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis, Finding

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
            "story": diagnosis.story(),
            "verdict_sentence": verdict_sentence(diagnosis),
            "units": units,
            "n_samples": signals.n_samples,
            "n_trajectories": len(np.unique(signals.trajectory)),
            "comparison": diagnosis.comparison.table(),
            "failures": [asdict(failure) for failure in diagnosis.failures],
            "rest_errors": [asdict(error) for error in diagnosis.rest_errors],
            "noise": diagnosis.noise,
            "regimes": list(diagnosis.regimes),
            "judged": judged_regimes(diagnosis),
            "remainder": remainders(diagnosis),
            "error_map": diagnosis.error_map(),
            "findings": [
                {**finding.to_dict(), "title": finding.title, "code": finding.code,
                 "formula": formula(finding.kind), "notes": notes(finding),
                 "sure": sure(finding),
                 "curves": finding.curves, "maps": residual_maps(diagnosis, finding)}
                for finding in diagnosis.findings
            ],
            "budget": diagnosis.budget,
            "left": predictable_left(diagnosis),
            "warnings": list(diagnosis.warnings),
            "traces": traces(diagnosis),
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
    if not diagnosis.findings and diagnosis.verdict == "unknown":
        told = diagnosis.story()
        return f"{told['headline']}. {told['left']}"
    if not diagnosis.findings and left:
        return (
            "No effect stands out enough to be called missing, but the error is not all noise: on "
            f"{joints_told(sorted(row['joint'] for row in left))} part of it can be predicted from "
            "the motion."
        )
    if not diagnosis.findings:
        return (
            "Nothing significant is missing: what is left of the error looks like noise in this "
            "data."
        )
    named = [f for f in diagnosis.findings if f.kind != "unknown"]
    parts = [f"{f.title} ({joints_told(f.joints)}{_rivals(f.rivals)})" for f in named]
    text = ""
    if parts:
        text = f"{listed(parts)} {'is' if len(parts) == 1 else 'are'} missing."
    if diagnosis.unexplained:
        where = joints_told(diagnosis.unexplained["joints"])
        variables = listed(list(diagnosis.unexplained["variables"]))
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


def _rivals(kinds: Any) -> str:
    """A name that the data do not settle is not said without its rivals."""
    return f"; or {', '.join(kind.replace('_', ' ') for kind in kinds)}" if kinds else ""


def judged_regimes(diagnosis: Diagnosis) -> list[list[bool]]:
    """Whether effects are judged in a regime, by joint and regime."""
    judged = diagnosis.comparison.judged_samples
    table = []
    for inside in regimes(diagnosis.comparison).values():
        count = np.maximum(inside.sum(0), 1)
        table.append((inside & judged).sum(0) >= 0.5 * count)
    found: list[list[bool]] = np.array(table).T.tolist()
    return found


def remainders(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """What the completed model leaves of each joint, where the diagnosis tells it apart.

    Noise of the torque sensor and of the positions, ``predictable`` what the signals still tell,
    ``remainder`` what is neither; N m or N.
    """
    parts = diagnosis.parts
    if parts is None:
        return []
    return [
        {
            "joint": j + 1,
            "name": name,
            "unit": diagnosis.comparison.units[j],
            "after": diagnosis.rmse_after[j],
            "torque_noise": parts.sensor_noise[j],
            "position_noise": parts.position_noise[j],
            "predictable": parts.predictable[j],
            "remainder": parts.left[j],
        }
        for j, name in enumerate(diagnosis.joint_names)
    ]


def notes(finding: Finding) -> list[str]:
    """What there is to say of a finding beside its name, size and rivals."""
    sentences = []
    caveat = "" if finding.kind == "unknown" else get_effect(finding.kind).caveat
    if caveat:
        sentences.append(f"Note that {caveat}.")
    mass = finding.parameters.get("mass", {}).get("value", 0.0)
    if isinstance(mass, float) and mass < 0:
        sentences.append("The mass is negative: the description has a load that the robot lacks.")
    return sentences


def formula(kind: str) -> str:
    """Formula of a kind in LaTeX, empty for what has none."""
    return "" if kind == "unknown" else str(get_effect(kind).formula)
