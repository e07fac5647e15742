# SPDX-License-Identifier: BSD-3-Clause
"""The functions of the explorer without a browser: rank, add and remove effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._exceptions import EffectError
from skidyn.diagnosis import Candidate, refine
from skidyn.effects import get_effect
from skidyn.explorer._script import script
from skidyn.explorer._seen import Seen
from skidyn.explorer._state import is_fine
from skidyn.explorer._sure import margin
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller

#: Number of effects in a ranking.
RANKED = 8
#: A click selects an interval of this length, s, with at least this many averaged rows.
STRETCH, LEAST_ROWS = 1.0, 8
#: An effect that removes a smaller share of the held-out squared error of samples is not listed.
LEAST_DROP = 0.02
#: Number of digits of the shares by which effects are ranked.
EQUAL = 3


@dataclass(frozen=True)
class RankedEffect:
    """An effect that could be added to a joint.

    Parameters
    ----------
    kind : str
        Kind of the catalogue.
    title, formula : str
        Text for display.
    joints : tuple of int
        Joints on which it acts, counted from 1.
    drop : float
        Share of the squared held-out residual of the chosen joint that it removes when the whole
        model is fitted again. The residual is averaged over the windows of the fit, which removes
        most of the noise.
    drop_here : float
        The same in the chosen interval of time; equal to ``drop`` if none is chosen.
    trajectories : tuple of int, default=()
        Recordings in which it acts, for a payload or a force at the tool; empty for all. Such an
        effect is judged on interleaved quarters of the recordings, a torque ripple on single
        samples; the drop of both is that of the whole log.

    Examples
    --------
    >>> RankedEffect("spring", "Spring", "k q", (2,), 0.4, 0.6).kind
    'spring'
    """

    kind: str
    title: str
    formula: str
    joints: tuple[int, ...]
    drop: float
    drop_here: float
    trajectories: tuple[int, ...] = ()


class Session(Seen):
    """A model, a log, and the effects added so far.

    Parameters
    ----------
    model : RBDRegressor
        The model to start from; it need not be fitted.
    X : DataFrame or array of shape (n_samples, n_features)
        Motion with time and trajectory, following the X contract.
    tau : array-like of shape (n_samples, n_joints)
        Measured torque, N m (N for sliders).

    Attributes
    ----------
    robot : Robot
        Robot of the model.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), "spring", joints=[2])
    >>> session = Session(RBDRegressor(log.robot), log.X, log.y)
    >>> session.ranked(joint=2)[0].kind
    'spring'
    >>> _ = session.add("spring", joint=2)
    >>> session.history[-1]["rmse"][1] < 0.2 * session.history[0]["rmse"][1]
    True
    """

    def stretch(self, joint: int, trajectory: int, time: float) -> tuple[float, float]:
        """The second around a moment, or a longer interval if the joint slides too little in it.

        Parameters
        ----------
        joint : int
            Joint, counted from 1.
        trajectory : int
            Trajectory.
        time : float, s
            Moment.

        Returns
        -------
        tuple of float, s
            Start and end.

        Raises
        ------
        EffectError
            The joint does not slide in this trajectory: no effect can be judged there.
        """
        j = self._joint(joint)
        rows = self.problem.rows
        away = np.sort(np.abs(rows.time[j][rows.trajectory[j] == trajectory] - time))
        if not len(away):
            raise EffectError(
                f"joint {joint} does not move in trajectory {trajectory}, so effects cannot be "
                "judged there; choose another trajectory"
            )
        half = max(STRETCH / 2, float(away[min(LEAST_ROWS, len(away)) - 1]))
        return time - half, time + half

    def ranked(
        self,
        joint: int,
        trajectory: int | None = None,
        span: tuple[float, float] | None = None,
    ) -> list[RankedEffect]:
        """Effects that lower the held-out error of a joint, the largest drop first.

        Every number is computed from the log: the model is fitted with the effect to the other
        folds, and its residual is compared with that of the present model.

        Parameters
        ----------
        joint : int
            Joint, counted from 1.
        trajectory : int, optional
            Trajectory in which the model fails, together with ``span``.
        span : tuple of float, s, optional
            Interval of time within the trajectory; the ranking is by the drop there.

        Returns
        -------
        list of RankedEffect
            The best candidate of every kind; of equal ones, to a thousandth, the simpler is first.
        """
        j = self._joint(joint)
        found = self._held_out(j)
        drop = found.drops()
        rows = self._rows_in(j, trajectory, span)
        here = drop if rows.all() else found.drops(rows)
        best: dict[str, RankedEffect] = {}
        least = LEAST_DROP / self._of_samples(j, found)
        for at in np.argsort(-drop, kind="stable"):
            candidate = self._pool[found.index[at]]
            if min(drop[at], here[at]) < least or candidate.kind in best:
                continue
            if self._has(candidate):
                continue
            best[candidate.kind] = _shown(candidate, float(drop[at]), float(here[at]))
        # of several offers of a kind, such as payloads of two links, the largest is shown
        for offer in sorted(self._offers(j), key=lambda offer: float(offer.drop[j])):
            share, which = float(offer.drop[j]), offer.candidate.term.trajectories
            inside = trajectory is None or which is None or trajectory in which
            if share >= LEAST_DROP and inside:
                best[offer.candidate.kind] = _shown(offer.candidate, share, share)
        return sorted(best.values(), key=_order)[:RANKED]

    def add(self, kind: str, joint: int, *, refined: bool = True) -> dict[str, Any]:
        """Add an effect where it helps a joint most, and fit the model again.

        Parameters
        ----------
        kind : str
            Kind of the catalogue.
        joint : int
            Joint, counted from 1.
        refined : bool, default=True
            Search the shape parameters, beginning at the grid. If False, :meth:`refine` has to be
            called for it; a page can then show a first answer at once.

        Returns
        -------
        dict
            The entry of :attr:`history`.

        Raises
        ------
        EffectError
            The effect does not act on this joint, or is in the model already.
        """
        j = self._joint(joint)
        found = self._held_out(j)
        drop = found.drops()
        pool = [
            (drop[at], self._pool[i])
            for at, i in enumerate(found.index)
            if self._pool[i].kind == kind and not self._has(self._pool[i])
        ]
        pool += [(o.drop[j], o.candidate) for o in self._offers(j) if o.candidate.kind == kind]
        if not pool:
            raise EffectError(
                f"{kind} cannot be added to joint {joint}: this log does not show it there, its "
                "fit is not physical, or it is already in the model"
            )
        candidate = max(pool, key=lambda item: item[0])[1]
        self._push(candidate, joint, margin(kind, self.ranked(joint)))
        return self.refine() if refined else self.history[-1]

    def refine(self) -> dict[str, Any]:
        """Search the shape parameters of the last addition from the grid on, and fit again.

        Returns
        -------
        dict
            The entry of :attr:`history`.
        """
        last = self._steps[-1]
        if last.coarse is not None:
            self._steps.pop()
            blocks = [self.problem.term_rows(t) for t in self.terms if not is_fine(t)]
            noise = self._steps[-1].noise
            better = refine(self.problem, blocks, [last.coarse], noise, self._target)[0]
            self._push(better, last.entry["joint"], last.margin)
            self._steps[-1].coarse = None
        return self.history[-1]

    def undo(self) -> dict[str, Any]:
        """Undo the last addition.

        Returns
        -------
        dict
            The entry of the step before.
        """
        if len(self._steps) > 1:
            self._steps.pop()
        return self.history[-1]

    def remove(self, step: int) -> dict[str, Any]:
        """Remove one addition and keep the later ones.

        Parameters
        ----------
        step : int
            Place in :attr:`history`, from 1.

        Returns
        -------
        dict
            The last entry of :attr:`history`; all later additions are fitted again.

        Raises
        ------
        EffectError
            There is no such addition.
        """
        if not 1 <= step < len(self._steps):
            raise EffectError(f"no addition {step}; there are {len(self._steps) - 1}")
        later = self._steps[step + 1 :]
        del self._steps[step:]
        for old in later:
            noise = self._steps[-1].noise
            self._steps.append(
                self._step(old.terms, (*self.terms, *old.terms), noise, old.entry["joint"])
            )
            self._steps[-1].coarse, self._steps[-1].margin = old.coarse, old.margin
        return self.history[-1]

    def fitted_model(self) -> RBDRegressor:
        """The model with all additions, fitted to the whole log.

        Returns
        -------
        RBDRegressor
            A fitted copy; the model of the session is not changed.
        """
        terms = [t for step in self.added for t in step]
        return self.model.with_effects(terms).fit(*self.data)

    def script(
        self,
        logs: Sequence[str] = ("log.csv",),
        urdf: str = "robot.urdf",
        *,
        joints: Sequence[str] | None = None,
        reading: Mapping[str, Any] | None = None,
        controller: Controller | None = None,
    ) -> str:
        """Python script that does the same without a browser.

        Parameters
        ----------
        logs : sequence of str
            Files of the log.
        urdf : str
            Description of the robot.
        joints : sequence of str, optional
            Joints the log covers, as given to :meth:`skidyn.robots.Robot.from_urdf`.
        reading : mapping, optional
            Further arguments with which :func:`skidyn.logs.read_log` read the log.
        controller : Controller, optional
            Position servos whose torque was computed from their commands.

        Returns
        -------
        str
            A script that makes the same additions, prints the held-out errors shown here and saves
            the model.
        """
        clicks = [(entry["added"], entry["joint"]) for entry in self.history[1:]]
        return script(self.model, clicks, logs, urdf, joints, reading or {}, controller)

    def check_place(self, joint: int, trajectory: int) -> None:
        """Raise unless there are such a joint, counted from 1, and such a trajectory.

        Parameters
        ----------
        joint : int
            Joint, counted from 1.
        trajectory : int
            Number of a recorded trajectory, one of :attr:`trajectories`.

        Raises
        ------
        EffectError
            There is no such joint, or no such trajectory.
        """
        self._joint(joint)
        self._check_trajectory(trajectory)

    def _rows_in(
        self, joint: int, trajectory: int | None, span: tuple[float, float] | None
    ) -> NDArray[np.bool_]:
        rows = self.problem.rows
        inside = np.ones(len(rows.time[joint]), dtype=bool)
        if trajectory is not None:
            inside &= rows.trajectory[joint] == trajectory
        if span is not None:
            inside &= (rows.time[joint] >= min(span)) & (rows.time[joint] <= max(span))
        return inside


def _shown(candidate: Candidate, drop: float, drop_here: float) -> RankedEffect:
    effect = candidate.term.effect
    return RankedEffect(
        candidate.kind,
        effect.title,
        effect.formula,
        tuple(joint + 1 for joint in candidate.joints),
        drop,
        drop_here,
        candidate.term.trajectories or (),
    )


def _order(effect: RankedEffect) -> tuple[float, int]:
    return -round(effect.drop_here, EQUAL), get_effect(effect.kind).simplicity
