# SPDX-License-Identifier: BSD-3-Clause
"""Common parameters of a fleet and the robots that deviate from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.evidence import Evidence
from skidyn.identification import weighted_solution

#: Least number of robots to estimate the usual differences between robots of the type.
FEWEST_ROBOTS = 8
#: Median absolute deviation of a normal variable, as a share of its standard deviation.
MAD_OF_NORMAL = float(stats.norm.ppf(0.75))


@dataclass(frozen=True)
class FleetComparison:
    """Common coefficients of a fleet and every robot's deviation from them.

    Parameters
    ----------
    robots : tuple of str
        Names of the robots.
    columns : tuple of str
        Coefficients that may deviate.
    common : dict of str to float
        Every coefficient fitted to all robots together, SI units.
    deviation : ndarray of shape (n_robots, n_columns)
        Coefficient of each robot minus the common one, SI units; NaN if its motion does not
        determine it.
    score : ndarray of shape (n_robots, n_columns)
        Deviation in units of the robust scatter between the robots.
    q_value : ndarray of shape (n_robots, n_columns)
        Benjamini-Hochberg adjusted p-values over all robots and columns.

    Examples
    --------
    >>> import numpy as np
    >>> comparison = FleetComparison(
    ...     ("a",), ("viscous.Fv[1]",), {}, np.ones((1, 1)), np.ones((1, 1)), np.zeros((1, 1))
    ... )
    >>> comparison.table()[0]["robot"]
    'a'
    """

    robots: tuple[str, ...]
    columns: tuple[str, ...]
    common: dict[str, float]
    deviation: Array
    score: Array
    q_value: Array

    def table(self, false_discovery_rate: float = 0.05) -> list[dict[str, Any]]:
        """Robots that deviate, the largest score first.

        Parameters
        ----------
        false_discovery_rate : float, default=0.05
            Expected share of false rows among those of the table.

        Returns
        -------
        list of dict
            ``robot``, ``column``, ``common`` and ``deviation`` (SI units), ``score``, ``q_value``.
        """
        found = np.argwhere(self.q_value <= false_discovery_rate)
        rows = [
            {
                "robot": self.robots[r],
                "column": self.columns[c],
                "common": self.common.get(self.columns[c]),
                "deviation": float(self.deviation[r, c]),
                "score": float(self.score[r, c]),
                "q_value": float(self.q_value[r, c]),
            }
            for r, c in found
        ]
        return sorted(rows, key=lambda row: -abs(row["score"]))


def compare_fleet(
    evidence: Mapping[str, Evidence], columns: Sequence[str] | None = None
) -> FleetComparison:
    """Fit all robots together and find those that deviate, and in which coefficients.

    The spread of normal robots is estimated from the fleet itself: each deviation is divided by its
    standard error, and then centred and scaled by the median and the median absolute deviation over
    the robots, which is insensitive to unmodelled effects common to all robots and to a few worn
    robots.

    Parameters
    ----------
    evidence : mapping of str to Evidence
        Evidence of every robot, with equal columns.
    columns : sequence of str, optional
        Coefficients that may deviate; by default those of the effects. The others are common.

    Returns
    -------
    FleetComparison
        Common coefficients, deviations and their q-values.

    Raises
    ------
    SkidynError
        Fewer than 8 robots, evidence of different columns or with NaN, or an unknown column.

    References
    ----------
    B. Efron (2004), Large-scale simultaneous hypothesis testing: the choice of a null hypothesis,
    J. American Statistical Association 99, 96-104.
    Y. Benjamini, Y. Hochberg (1995), Controlling the false discovery rate, J. Royal Statistical
    Society B 57(1), 289-300.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.evidence import Evidence
    >>> rng, fleet = np.random.default_rng(0), {}
    >>> for k in range(20):
    ...     a = rng.normal(size=(200, 2))
    ...     torque = a @ [3.0, 1.0 + 2.0 * (k == 7)] + 0.1 * rng.normal(size=200)
    ...     rows = np.column_stack([a, torque])
    ...     fleet[f"robot {k}"] = Evidence.from_rows(("m_link1", "viscous.Fv[1]"), {(0, 0): rows})
    >>> [(row["robot"], row["column"]) for row in compare_fleet(fleet).table()]
    [('robot 7', 'viscous.Fv[1]')]
    """
    if len(evidence) < FEWEST_ROBOTS:
        raise SkidynError(
            f"{len(evidence)} robots are too few to estimate how robots of a type differ; "
            f"{FEWEST_ROBOTS} are needed"
        )
    parts = list(evidence.values())
    if any(part.columns != parts[0].columns for part in parts):
        odd = next(n for n, part in evidence.items() if part.columns != parts[0].columns)
        raise SkidynError(f"the evidence of robot {odd!r} has different columns than the first one")
    for name, part in evidence.items():
        if not all(np.isfinite(factor).all() for factor in part.factors.values()):
            raise SkidynError(
                f"the evidence of robot {name!r} holds NaN or infinite values; leave the robot "
                "out, or read its log again"
            )
    coefficients, noise = weighted_solution(merge(parts))
    chosen = effect_columns(parts[0], columns)
    index = [parts[0].columns.index(name) for name in chosen]
    answers = [deviation(part, coefficients, noise, index) for part in parts]
    difference = np.array([a[0] for a in answers])
    ratio = difference / np.array([a[1] for a in answers])
    centre = np.nanmedian(ratio, axis=0)
    scale = np.nanmedian(np.abs(ratio - centre), axis=0) / MAD_OF_NORMAL
    score = (ratio - centre) / np.where(scale > 0, scale, np.inf)
    p = 2 * stats.t.sf(np.abs(score), len(parts) - 1)
    return FleetComparison(
        tuple(evidence),
        tuple(chosen),
        dict(zip(parts[0].columns, map(float, coefficients), strict=True)),
        difference,
        score,
        _adjusted(p),
    )


def merge(parts: Sequence[Evidence]) -> Evidence:
    """All evidence as trajectory 0, with one factor per joint whatever the number of parts."""
    total: Evidence | None = None
    for part in parts:
        rows = {
            (0, j): np.vstack([f for key, f in part.factors.items() if key[1] == j])
            for j in part.joints
        }
        one = Evidence.from_rows(part.columns, rows)
        counts = {
            (0, j): sum(n for key, n in part.counts.items() if key[1] == j) for j in part.joints
        }
        one = Evidence(one.columns, one.factors, counts)
        total = one if total is None else total + one
    if total is None:
        raise SkidynError("no evidence to merge")
    return total


def effect_columns(evidence: Evidence, columns: Sequence[str] | None) -> list[str]:
    """Columns that may deviate: the requested ones, else those of the effects.

    A SkidynError is raised if a column is unknown, or there are none.
    """
    if columns is None:
        columns = [name for name in evidence.columns if "[" in name]
    unknown = [name for name in columns if name not in evidence.columns]
    if unknown or not columns:
        raise SkidynError(
            f"no column {unknown[0] if unknown else 'of an effect'}; there are "
            f"{', '.join(evidence.columns)}"
        )
    return list(columns)


def deviation(
    evidence: Evidence, coefficients: Array, noise: Mapping[int, float], index: Sequence[int]
) -> tuple[Array, Array]:
    """Deviation of some coefficients of a robot from the common ones, and its standard error.

    All other coefficients are fixed; ``noise`` is that of a row of every joint, N m or N. Both are
    NaN for columns that the motion does not excite.
    """
    stacked = np.vstack([factor / noise[key[1]] for key, factor in evidence.factors.items()])
    a, rest = stacked[:, list(index)], stacked[:, -1] - stacked[:, :-1] @ coefficients
    size = np.linalg.norm(a, axis=0)
    moved = np.flatnonzero(size > 1e-9 * max(size.max(initial=0.0), 1e-300))
    result, error = np.full((2, len(index)), np.nan)
    if len(moved):
        inverse = np.linalg.pinv(a[:, moved] / size[moved], rcond=1e-8)
        result[moved] = inverse @ rest / size[moved]
        error[moved] = np.linalg.norm(inverse, axis=1) / size[moved]
    return result, error


def _adjusted(p: NDArray[np.float64]) -> Array:
    """Benjamini-Hochberg over everything that could be tested; NaN elsewhere."""
    q = np.full(p.shape, np.nan)
    tested = np.isfinite(p)
    if tested.any():
        q[tested] = stats.false_discovery_control(p[tested])
    return q
