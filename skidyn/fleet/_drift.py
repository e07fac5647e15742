# SPDX-License-Identifier: BSD-3-Clause
"""Drift of one robot over time: coefficients that left their bands, and when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn._text import trajectories_told
from skidyn.evidence import Evidence
from skidyn.fleet._deviation import deviation, effect_columns
from skidyn.identification import weighted_solution

#: Weight of the newest trajectory in the moving average.
NEWEST = 0.25


@dataclass(frozen=True)
class DriftReport:
    """Coefficients of one robot over its trajectories, and their bands.

    Parameters
    ----------
    columns : tuple of str
        Monitored coefficients.
    dates : tuple
        Date of every trajectory, in the order of the rows below.
    value : ndarray of shape (n_trajectories, n_columns)
        Exponentially weighted moving average of the coefficient, SI units.
    low, high : ndarray of shape (n_trajectories, n_columns)
        Band that a robot without drift does not leave; infinite during the reference.

    Examples
    --------
    >>> import numpy as np
    >>> report = DriftReport(
    ...     ("coulomb.Fc[3]",), ("3 March", "4 March"), np.array([[5.0], [9.0]]),
    ...     np.full((2, 1), 4.0), np.full((2, 1), 6.0),
    ... )
    >>> report.messages()
    ['coulomb.Fc[3] left its band on 4 March: 9, expected 4 to 6']
    """

    columns: tuple[str, ...]
    dates: tuple[Any, ...]
    value: Array
    low: Array
    high: Array

    def alarms(self) -> list[dict[str, Any]]:
        """First time that each coefficient left its band, the earliest first.

        Returns
        -------
        list of dict
            ``column``, ``date``, ``value``, ``low``, ``high`` (SI units).
        """
        outside = (self.value < self.low) | (self.value > self.high)
        found = []
        for c in np.flatnonzero(outside.any(axis=0)):
            k = int(np.argmax(outside[:, c]))
            numbers = {n: float(getattr(self, n)[k, c]) for n in ("value", "low", "high")}
            found.append((k, {"column": self.columns[c], "date": self.dates[k], **numbers}))
        return [alarm for _, alarm in sorted(found, key=lambda item: item[0])]

    def messages(self) -> list[str]:
        """Sentences for the alarms.

        Returns
        -------
        list of str
            One sentence for each coefficient that left its band.
        """
        return [
            f"{a['column']} left its band on {a['date']}: {a['value']:.4g}, expected "
            f"{a['low']:.4g} to {a['high']:.4g}"
            for a in self.alarms()
        ]


def monitor_drift(
    evidence: Evidence,
    *,
    columns: Sequence[str] | None = None,
    dates: Mapping[int, Any] | None = None,
    reference: int = 20,
    false_alarm: float = 0.01,
) -> DriftReport:
    """Monitor the effects of one robot, trajectory by trajectory.

    The model is fitted to the first trajectories; their spread gives the band of a moving average
    over the later ones, wide enough that a robot without drift raises any alarm at all with at
    most the given probability (Bonferroni over coefficients and trajectories), as long as
    trajectories scatter normally and independently.

    Parameters
    ----------
    evidence : Evidence
        One factor for each trajectory, numbered in the order of time (``groups=None``).
    columns : sequence of str, optional
        Coefficients to monitor; by default those of the effects.
    dates : mapping of int to object, optional
        Date of each trajectory; by default its number.
    reference : int, default=20
        Number of initial trajectories that are assumed to be healthy.
    false_alarm : float, default=0.01
        Highest probability of any alarm without drift.

    Returns
    -------
    DriftReport
        Moving averages, bands and alarms.

    Raises
    ------
    SkidynError
        Fewer than 8 reference trajectories, or none after them; a false-alarm rate that is no
        probability; a trajectory without a date.

    References
    ----------
    S. W. Roberts (1959), Control chart tests based on geometric moving averages, Technometrics
    1(3), 239-250.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.evidence import Evidence
    >>> rng, rows = np.random.default_rng(0), {}
    >>> for day in range(60):
    ...     a = rng.normal(size=(200, 1))
    ...     friction = 5.0 + (0.2 if day >= 40 else 0.0)
    ...     rows[day, 0] = np.column_stack([a, friction * a + 0.5 * rng.normal(size=(200, 1))])
    >>> report = monitor_drift(Evidence.from_rows(("coulomb.Fc[1]",), rows))
    >>> report.alarms()[0]["date"] in range(40, 45)
    True
    """
    names = evidence.trajectories
    if reference < 8 or len(names) <= reference:
        raise SkidynError(
            f"{len(names)} trajectories with reference={reference}; at least 8 reference "
            "trajectories and one after them are needed"
        )
    if not 0 < false_alarm < 1:
        raise SkidynError(f"false_alarm={false_alarm!r}; a probability between 0 and 1 is expected")
    undated = [] if dates is None else [k for k in names if k not in dates]
    if undated:
        raise SkidynError(
            f"dates lacks {trajectories_told(undated)}; give the date of every trajectory, or "
            "dates=None"
        )
    chosen = effect_columns(evidence, columns)
    index = [evidence.columns.index(name) for name in chosen]
    common, noise = weighted_solution(evidence.only(names[:reference]))
    change = [deviation(evidence.only([k]), common, noise, index)[0] for k in names]
    value = common[index] + np.array(change)
    centre = np.nanmean(value[:reference], axis=0)
    spread = np.nanstd(value[:reference], axis=0, ddof=1)
    n_watched = len(names) - reference
    limit = stats.t.isf(false_alarm / 2 / (n_watched * len(chosen)), reference - 1)
    average = np.array(value)
    previous, low, high = centre, np.full_like(value, -np.inf), np.full_like(value, np.inf)
    for k in range(n_watched):
        row = reference + k
        # A trajectory that does not excite a coefficient has no information about it.
        new = np.where(np.isnan(value[row]), previous, value[row])
        previous = average[row] = NEWEST * new + (1 - NEWEST) * previous
        memory = (1 - NEWEST) ** (k + 1)
        own = NEWEST / (2 - NEWEST) * (1 - memory**2)
        half = limit * spread * np.sqrt(own + (1 - memory) ** 2 / reference)
        low[row], high[row] = centre - half, centre + half
    labels = tuple(names if dates is None else (dates[k] for k in names))
    return DriftReport(tuple(chosen), labels, average, low, high)
