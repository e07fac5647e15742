# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis as a plain dictionary with all data of the page, without further computation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._plain import plain
from skidyn._version import versions
from skidyn.report._picture import read_all

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis


def summarize(
    diagnosis: Diagnosis,
    *,
    title: str | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Summarize a diagnosis for the report page, as a dictionary of JSON values.

    Parameters
    ----------
    diagnosis : Diagnosis
        From :func:`skidyn.diagnosis.diagnose`.
    title : str, optional
        Heading of the page; the name of the robot by default.
    provenance : mapping, optional
        Provenance of the numbers: files with their hashes, options. Versions are added.

    Returns
    -------
    summary : dict
        ``report`` is the machine-readable report (schema ``skidyn.diagnosis/1``), ``story`` the
        first screen; the rest is the data of the figures of the page, each under its name. Long
        signals are reduced without losing peaks. Errors are in N m, N for sliding joints.

    Examples
    --------
    >>> from skidyn.report import summarize
    >>> summary = summarize(diagnosis)  # doctest: +SKIP
    >>> summary["story"]["headline"]  # doctest: +SKIP
    'Missing: Stribeck friction on joint 2'
    """
    signals = diagnosis.comparison.signals
    told = {"versions": versions(), **(provenance or {})}
    report = {**diagnosis.to_dict(), "provenance": told}
    document: dict[str, Any] = plain(
        {
            "report": report,
            "title": title or getattr(signals.robot, "name", "") or "Robot inverse dynamics",
            "story": diagnosis.story(),
            "units": diagnosis.comparison.units,
            "noise": diagnosis.noise,
            "n_samples": signals.n_samples,
            "n_trajectories": len(np.unique(signals.trajectory)),
            **read_all("diagnosis", diagnosis),
        }
    )
    return document
