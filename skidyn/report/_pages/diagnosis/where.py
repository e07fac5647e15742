# SPDX-License-Identifier: BSD-3-Clause
"""Where the model fails: joints, regimes, and errors at rest."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from skidyn.report._heat import heat, judged_regimes
from skidyn.report._picture import Canvas, Picture, Summary

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis


class Where(Picture):
    """Joints by their error over noise, and a map of the errors."""

    place, title = 10, "Where the model fails"

    def read(self, subject: Diagnosis) -> dict[str, Any]:
        """Failures in words, the error map, and errors at rest compared with dry friction."""
        return {
            "failures": [asdict(failure) for failure in subject.failures],
            "rest_errors": [asdict(error) for error in subject.rest_errors],
            "regimes": list(subject.regimes),
            "errors": subject.error_map(),
            "judged": judged_regimes(subject),
        }

    def show(self, summary: Summary, canvas: Canvas) -> dict[str, Any]:
        """The map in colours."""
        own = summary["where"]
        return {**own, "heat": heat(own["errors"], summary["noise"], own["judged"])}
