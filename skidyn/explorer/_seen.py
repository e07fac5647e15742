# SPDX-License-Identifier: BSD-3-Clause
"""Results that a session shows: parameters and confidence of added effects, curves, residuals."""

from __future__ import annotations

from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn._text import measure
from skidyn.diagnosis import parameter_intervals, variance_inflation
from skidyn.effects import Term
from skidyn.evidence import jackknife
from skidyn.explorer._beside import Ripple
from skidyn.explorer._state import State, is_fine
from skidyn.explorer._sure import sure_told
from skidyn.report import rows_with_peaks

#: Number of parameters of an addition that are shown, and half the width of a 95 % interval.
TOLD, NORMAL = 3, 1.96
#: Points of a curve.
POINTS = 1500


class Seen(State):
    """Numbers and curves of the given and of the present model."""

    def sizes(self) -> list[str]:
        """Parameters of every addition with half their 95 % intervals."""
        if not self.added:
            return []
        rest = [t for t in self.terms if not is_fine(t)]
        intervals = parameter_intervals(self.problem, rest, self._steps[-1].noise)
        for term, ripple in self._steps[-1].ripples.items():
            intervals[term] = _ripple_intervals(term, ripple)
        slides = self.problem.signals.prismatic
        return [
            ", ".join(
                measure(name, value, term.effect.units(bool(slides[term.places[0]])).get(name, ""))
                for term in terms
                for name, value in list(intervals[term].items())[:TOLD]
            )
            for terms in self.added
        ]

    def sure(self) -> list[str]:
        """Confidence that every added effect is the right one, such as ``"confidence 90%"``.

        As in a diagnosis, it follows from the error that the best other effect would have removed
        instead, and from the error that remains on its joints.
        """
        residual, rows = self._steps[-1].residual, self.problem.rows
        everywhere = range(self.problem.n_joints)
        averaged = [rows.average(residual[:, j], j) for j in everywhere]
        inflation = variance_inflation(self.problem, averaged, everywhere)
        errors = np.maximum([entry["rmse"] for entry in self.history], 1e-300)
        removed = 1 - (errors[1:] / errors[:-1]) ** 2
        told = []
        for step, drop in zip(self._steps[1:], removed, strict=True):
            joints = [j - 1 for j in step.entry["joints"]]
            told.append(
                sure_told(
                    step.margin,
                    float(inflation[joints].max()),
                    float(drop[joints].max()),
                    self.problem.whole_trajectories,
                )
            )
        return told

    def curves(self, joint: int, trajectory: int) -> dict[str, list[float | None]]:
        """Measured torque, and held-out torque of the given and of the present model, N m or N.

        There are few points, with the peaks kept. The models are None where the joint, from 1,
        rests or turns: these samples are not judged.
        """
        j = self._joint(joint)
        here = np.flatnonzero(self.problem.signals.trajectory == trajectory)
        self._check_trajectory(trajectory)
        measured = self.torque[here, j]
        sliding = self.problem.rows.sliding[here, j]
        models = [
            np.where(sliding, measured - step.residual[here, j], np.nan)
            for step in (self._steps[0], self._steps[-1])
        ]
        drawn = [measured, *(np.where(sliding, model, measured) for model in models)]
        rows = rows_with_peaks(drawn, [slice(0, len(here))], POINTS // 6)[0]
        return {
            "time": self.problem.signals.clock[here][rows].tolist(),
            "measured": measured[rows].tolist(),
            "given": _holes(models[0][rows]),
            "now": _holes(models[1][rows]),
        }

    def residuals(self, joint: int, trajectory: int) -> dict[str, list[float | None]]:
        """Held-out residual of both, averaged over the windows by which models are fitted.

        It is in N m or N, and None where the joint, from 1, rests or turns.
        """
        j = self._joint(joint)
        self._check_trajectory(trajectory)
        rows = self.problem.rows
        here = np.flatnonzero(rows.trajectory[j] == trajectory)
        here = here[np.argsort(rows.time[j][here], kind="stable")]
        time = rows.time[j][here]
        # a row is scaled to the noise of one sample: back to a mean
        weight = np.asarray(rows.weights[j].sum(axis=1)).ravel()[here]
        ends = [
            self._ranking.residual(step.model, j)[here] / weight
            for step in (self._steps[0], self._steps[-1])
        ]
        whole = [slice(0, len(here))]
        keep = rows_with_peaks(ends, whole, POINTS // 4)[0] if len(here) else here
        apart = np.diff(time[keep])
        usual = np.median(np.diff(time)) if len(apart) else 0.0
        gaps = np.flatnonzero(apart > 4 * usual) + 1
        given, now = (np.insert(r[keep], gaps, np.nan) for r in ends)
        middles = [(time[keep][k - 1] + time[keep][k]) / 2 for k in gaps]
        return {
            "time": _holes(np.insert(time[keep], gaps, middles)),
            "given": _holes(given),
            "now": _holes(now),
        }


def _ripple_intervals(term: Term, ripple: Ripple) -> dict[str, Any]:
    """Parameters of a ripple; its amplitude with a 95 % interval."""
    told: dict[str, Any] = dict(term.parameters(ripple.whole))
    size, spread = told["A"], NORMAL * float(jackknife(np.hypot(*ripple.left_out.T)))
    told["A"] = (size, size - spread, size + spread)
    return told


def _holes(values: Array) -> list[float | None]:
    """Numbers for JSON; None where there is none."""
    return [None if np.isnan(x) else float(x) for x in values]
