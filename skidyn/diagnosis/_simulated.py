# SPDX-License-Identifier: BSD-3-Clause
"""Results of the simulated motion of a diagnosis: for the report, as text, and by joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._plain import plain
from skidyn._text import inside, joints_told, listed

if TYPE_CHECKING:
    from skidyn.diagnosis._findings import Finding
    from skidyn.simulation import InTurn, SimulationErrors, SimulationVerdict

#: Reported errors of the motion of each joint, root mean squares over the held-out pieces.
MEASURES = ("position", "final", "velocity")


def report_of(in_turn: InTurn | None) -> dict[str, Any] | None:
    """Errors of the simulated motion for the report file.

    Parameters
    ----------
    in_turn : InTurn or None
        None where no simulation was asked for.

    Returns
    -------
    dict or None
        ``units`` of the positions (``"rad"`` or ``"m"``; velocities are these per second),
        ``horizon`` in s, ``n_pieces``; ``before`` and ``after`` with ``position``, ``final`` (at
        the end of the pieces), ``velocity`` per joint and ``n_lost``; ``without_forces``
        (position); ``change`` of the error as a share with its 95 % interval; ``says``.
    """
    if in_turn is None:
        return None
    verdict = in_turn.together
    report: dict[str, Any] = plain(
        {
            "units": list(verdict.before.units),
            "horizon": verdict.before.horizon,
            "n_pieces": len(verdict.before.pieces),
            "before": _errors(verdict.before),
            "after": _errors(verdict.after),
            "without_forces": verdict.before.resting,
            "change": _change(verdict),
            "says": "nothing" if in_turn.silent else _says(verdict),
        }
    )
    return report


def of_finding(in_turn: InTurn | None, k: int) -> dict[str, Any]:
    """Entry of the report on the motion with one finding; empty without a simulation."""
    if in_turn is None:
        return {}
    verdict = in_turn.verdicts[k]
    own = {"says": "nothing", "change": None} if verdict is None else {
        "says": _says(verdict), "change": _change(verdict)
    }  # fmt: skip
    return {"simulation": plain({**own, "added": in_turn.added[k]})}


def simulated(in_turn: InTurn | None, findings: Sequence[Finding]) -> dict[str, Any] | None:
    """The same for display.

    Parameters
    ----------
    in_turn : InTurn or None
        None where no simulation was asked for.
    findings : sequence of Finding
        Findings of the diagnosis.

    Returns
    -------
    dict or None
        ``heading``, ``text``, ``added`` (whether there is a second model), and a row for each of
        ``joints``: ``joint`` (from 1), ``name``, ``unit``, ``before`` and ``after`` with
        ``position``, ``final``, ``velocity``, ``without_forces``, ``ratio`` (of the position
        error after to that before) and ``worse``.
    """
    if in_turn is None:
        return None
    verdict = in_turn.together
    before, after = verdict.before, verdict.after
    length = "whole recordings" if before.horizon is None else f"{before.horizon:g} s at a time"
    rows = []
    for j, (name, unit) in enumerate(zip(before.joint_names, before.units, strict=True)):
        errors = [{m: float(getattr(e, m)[j]) for m in MEASURES} for e in (before, after)]
        first, last = (own["position"] for own in errors)
        rows.append(
            {
                "joint": j + 1,
                "name": name,
                "unit": unit,
                "before": errors[0],
                "after": errors[1],
                "without_forces": float(before.resting[j]),
                "ratio": last / max(first, 1e-12) if np.isfinite([first, last]).all() else None,
                "worse": last > 1.02 * first,
            }
        )
    return {
        "heading": f"Simulated motion, {length}, on recordings left out of the fit",
        "text": " ".join(_sentences(in_turn, findings)),
        "added": any(in_turn.added),
        "joints": rows,
    }


def _sentences(in_turn: InTurn, findings: Sequence[Finding]) -> list[str]:
    together = in_turn.together
    told = []
    if in_turn.silent:
        told.append(
            "The simulated motion deviates more from the logged one than that of a model without "
            "forces and therefore gives no evidence about the findings."
        )
    elif any(in_turn.added):
        told.append(together.text)
    elif findings:
        told.append("No finding is added to the simulated model.")
    lost = max(together.before.n_lost, together.after.n_lost)
    if lost:
        told.append(
            f"The motion grows without bound in {lost} of {len(together.before.pieces)} pieces."
        )
    for why, simulable in (("worsens the motion", True), ("cannot be simulated", False)):
        out = [
            f"{inside(finding.title)} on {joints_told(finding.joints)}"
            for finding, verdict, added in zip(
                findings, in_turn.verdicts, in_turn.added, strict=True
            )
            if not added and (verdict is not None) == simulable
        ]
        if out:
            told.append(f"Left out because it {why}: {listed(out)}.")
    return told


def _errors(errors: SimulationErrors) -> dict[str, Any]:
    return {**{m: np.asarray(getattr(errors, m)) for m in MEASURES}, "n_lost": errors.n_lost}


def _change(verdict: SimulationVerdict) -> dict[str, float]:
    """Relative change of the error with its interval."""
    return {
        name: float(np.expm1(value))
        for name, value in (
            ("value", verdict.change),
            ("low", verdict.low),
            ("high", verdict.high),
        )
    }


def _says(verdict: SimulationVerdict) -> str:
    return "worsens" if verdict.worsens else "improves" if verdict.improves else "chance"
