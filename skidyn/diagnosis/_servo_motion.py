# SPDX-License-Identifier: BSD-3-Clause
"""Texts on effects identified from the motion of servos."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from skidyn._text import inside, joints_told, listed
from skidyn.effects import get_effect

if TYPE_CHECKING:
    from skidyn.diagnosis._findings import Finding
    from skidyn.simulation import ServoFinding


def servo_motion_told(
    named: Sequence[ServoFinding] | None, findings: Sequence[Finding]
) -> dict[str, Any] | None:
    """Effects identified from the motion of servos, for the first screen and the page.

    Parameters
    ----------
    named : sequence of ServoFinding or None
        None if the motion of servos was not analysed.
    findings : sequence of Finding
        Findings from the torque.

    Returns
    -------
    dict or None
        ``heading``, ``text``, and for each of ``findings`` ``kind``, ``joints``, ``what``,
        ``where``, ``size``, ``evidence``, ``sentence``, and the ``errors`` of the simulated
        position (``model`` and ``error`` in mrad or mm, ``unit``) with friction alone, with it and
        with its rival.
    """
    if named is None:
        return None
    told = [
        {
            "kind": found.kind,
            "joints": [found.joint],
            "what": found.title,
            "where": joints_told([found.joint]),
            "size": found.size,
            "evidence": found.evidence,
            "sentence": found.sentence,
            "errors": [
                {"model": model, "error": 1e3 * error, "unit": f"m{found.unit}"}
                for model, error in (
                    ("friction alone", found.before),
                    (inside(found.title), found.after),
                    (inside(get_effect(found.rival).title), found.beside),
                )
            ],
        }
        for found in named
    ]
    return {
        "heading": "Motion of the servos, with each joint simulated along its command",
        "text": _text(named, findings),
        "findings": told,
    }


def _text(named: Sequence[ServoFinding], findings: Sequence[Finding]) -> str:
    if not named:
        beside = " and the findings" if findings else ""
        return f"It requires no effect other than friction{beside}."
    same = [
        f"{inside(finding.title)} on {joints_told(finding.joints)}"
        for finding in findings
        if {found.joint for found in named} & set(finding.joints)
        and (finding.kind == "unknown" or get_effect(finding.kind).family == "hysteresis")
    ]
    if not same:
        return f"The torque does not show {'it' if len(named) == 1 else 'them'}."
    takes = "It takes" if len(named) == 1 else "They take"
    return f"{takes} the place of effects that the torque could not identify: {listed(same)}."
