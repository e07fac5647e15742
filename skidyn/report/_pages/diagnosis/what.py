# SPDX-License-Identifier: BSD-3-Clause
"""Missing effects: a card for every finding."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn.effects import get_effect
from skidyn.report._figures import finding_charts
from skidyn.report._maps import residual_maps
from skidyn.report._parameters import parameter_rows
from skidyn.report._picture import Canvas, Picture, Summary

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis, Finding


class What(Picture):
    """Formula, curve, parameters with intervals, rivals, and the line that adds it."""

    place, title = 30, "What is missing"

    def read(self, subject: Diagnosis) -> list[dict[str, Any]]:
        """Every finding with its curves and maps."""
        from skidyn.diagnosis import notes  # not needed to write a page

        return [
            {
                **finding.to_dict(),
                "title": finding.title,
                "code": finding.code,
                "formula": _formula(finding),
                "proposals": [
                    {"joint": u.joint, "text": u.proposal.text}
                    for u in subject.unknowns
                    if finding.kind == "unknown" and u.proposal and u.joint in finding.joints
                ],
                "notes": notes(finding.kind, finding.parameters),
                "curves": finding.curves,
                "maps": residual_maps(subject, finding),
            }
            for finding in subject.findings
        ]

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any] | None:
        """Cards with numbered charts; nothing without findings."""
        cards = []
        for finding, line in zip(summary["what"], summary["story"]["cards"], strict=True):
            charts = [
                {**chart, "figure": canvas.figure(chart["drawn"])}
                for chart in finding_charts(finding, summary["units"])
            ]
            rows = parameter_rows(finding)
            cards.append({**finding, "line": line, "charts": charts, "rows": rows})
        return {"cards": cards} if cards else None


def _formula(finding: Finding) -> str:
    """The formula of a finding in its form, in LaTeX; none of an unknown torque."""
    if finding.kind == "unknown":
        return ""
    # a setting of a servo is no term
    shape = finding.terms[0].shape if finding.terms else {}
    return get_effect(finding.kind).formula_of(shape)
