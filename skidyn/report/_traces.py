# SPDX-License-Identifier: BSD-3-Clause
"""Torque over time, thinned for a screen, with unjudged intervals and peaks outside the axis."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals, runs_of
from skidyn.report._decimate import rows_with_peaks

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis

#: Buckets over the whole log; up to six rows of each bucket are drawn.
BUCKETS = 3000
#: Gap between pieces of a log on the axis of time, as a share of the whole.
GAP = 0.004
#: Unjudged intervals are joined if less than this share of the whole is between them.
JOIN = 1 / 1500
#: The axis of the residual shows this share of the judged samples, with this margin; peaks within
#: ``REACH`` times that are shown too.
SHOWN, ROOM, REACH = 0.998, 1.15, 1.6


def traces(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Measured and modelled torque over time for each joint, trajectories laid end to end.

    ``apart`` are stretches of time that are not judged, with the reason; ``frame`` is the range of
    the residual's axis and what lies outside it.
    """
    from skidyn.diagnosis import regimes  # not needed to write a page

    comparison, after = diagnosis.comparison, diagnosis.comparison_after
    signals = comparison.signals
    clock, starts = elapsed(signals)
    rest = regimes(comparison)["rest"]
    torques = {
        "measured": comparison.measured,
        "before": comparison.predicted,
        "after": after.predicted,
    }
    table = []
    for j in range(signals.n_joints):
        measured = comparison.measured[:, j]
        residuals = measured - comparison.predicted[:, j], measured - after.predicted[:, j]
        judged = comparison.judged_samples[:, j]
        table.append(
            {
                **thinned(signals, clock, torques, j),
                "starts": starts,
                "apart": [
                    *_stretches(clock, signals.segments, rest[:, j] & ~judged, "rest"),
                    *_stretches(clock, signals.segments, ~rest[:, j] & ~judged, "reversal"),
                ],
                "frame": _frame(residuals, judged),
            }
        )
    return table


def thinned(
    signals: Signals, clock: Array, torques: Mapping[str, Array], joint: int
) -> dict[str, Any]:
    """Torques of a joint over time without losing a peak of the measured one or a residual.

    ``breaks`` are the rows to which no line must be drawn from the previous one.
    """
    own = {name: values[:, joint] for name, values in torques.items()}
    measured = own["measured"]
    residuals = [measured - values for name, values in own.items() if name != "measured"]
    pieces = rows_with_peaks([measured, *residuals], signals.segments, BUCKETS)
    rows = np.concatenate(pieces)
    return {
        "time": np.round(clock[rows], 5),
        "breaks": np.cumsum([len(piece) for piece in pieces])[:-1],
        "columns": {name: values[rows] for name, values in own.items()},
    }


def _stretches(
    clock: Array, segments: list[slice], mask: NDArray[np.bool_], reason: str
) -> list[list[Any]]:
    """Beginning, end and reason of every run of samples, close ones joined."""
    found: list[list[Any]] = []
    gap = JOIN * float(clock[-1] - clock[0])
    for segment in segments:
        first = len(found)
        for a, b in zip(*runs_of(mask[segment]), strict=True):
            begin, end = (float(clock[segment.start + row]) for row in (a, b - 1))
            if len(found) > first and begin - found[-1][1] < gap:
                found[-1][1] = round(end, 4)
            else:
                found.append([round(begin, 4), round(end, 4), reason])
    return found


def _frame(residuals: tuple[Array, ...], judged: NDArray[np.bool_]) -> dict[str, Any]:
    """Range of the axis that shows nearly all judged samples, and the number of peaks outside."""
    peak = max(float(np.abs(r).max()) for r in residuals)
    use = judged if judged.any() else np.ones_like(judged)
    reach = ROOM * max(float(np.quantile(np.abs(r[use]), SHOWN)) for r in residuals)
    if not 0 < reach * REACH < peak:
        reach = ROOM * peak
    outside = np.any([np.abs(r) > reach for r in residuals], axis=0)
    return {"reach": reach or 1.0, "cut": int(outside.sum()), "largest": peak}


def elapsed(signals: Signals) -> tuple[Array, list[dict[str, Any]]]:
    """Time in s that continues over the borders of trajectories with a gap, and their starts."""
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


def packed_table(
    table: Mapping[str, Any], columns: Mapping[str, Iterable[float | None]]
) -> dict[str, Any]:
    """Columns over time in the format of the script."""
    return {
        "time": packed(table["time"]),
        "breaks": table["breaks"],
        "columns": {name: packed(values) for name, values in columns.items()},
    }


def packed(values: Iterable[float | None]) -> str:
    """Base64 of 32-bit floats, a fifth of their size as text; NaN if there is no number."""
    array = np.array([np.nan if v is None else v for v in values], dtype="<f4")
    return base64.b64encode(array.tobytes()).decode("ascii")
