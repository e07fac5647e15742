# SPDX-License-Identifier: BSD-3-Clause
"""What the explorer knows and does, without a browser."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._exceptions import EffectError
from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate, catalogue_candidates
from skidyn.diagnosis._profile import profile_error, refine
from skidyn.diagnosis._reading import read_signals
from skidyn.diagnosis._screen import Screen
from skidyn.effects import Term, get_effect, list_effects, make_terms
from skidyn.evidence._problem import Fit, make_problem
from skidyn.report._decimate import rows_with_peaks
from skidyn.rigid_body import RBDRegressor

#: Points of a curve, and effects in a ranking.
POINTS, RANKED = 1500, 8


@dataclass(frozen=True)
class RankedEffect:
    """An effect that could be added to a joint.

    Parameters
    ----------
    kind : str
        Kind of the catalogue.
    title, formula : str
        For people.
    joints : tuple of int
        Joints it acts on, counted from 1.
    drop : float
        Share of the joint's held-out squared error that it takes away; the rest of the model is
        fitted beside it.
    drop_here : float
        The same of the error in the chosen stretch of time, not held out.

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


class Session:
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
    added : list of tuple of Term
        What was added, step by step.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.rigid_body import RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), "spring", joints=[2])
    >>> session = Session(RBDRegressor(log.robot), log.X, log.y)
    >>> session.ranked(joint=2)[0].kind
    'spring'
    >>> _ = session.add("spring", joint=2)
    >>> session.history[-1]["rmse"][1] < 0.2 * session.history[0]["rmse"][1]
    True
    """

    def __init__(self, model: RBDRegressor, X: Any, tau: Any) -> None:
        from skidyn.robots import Robot

        self.model, self.data = model, (X, tau)
        robot = model.robot if isinstance(model.robot, Robot) else Robot.from_urdf(model.robot)
        self.robot = robot
        signals, torque = read_signals(X, tau, robot, trajectory=model.trajectory, time=model.time)
        self.torque = torque
        terms = make_terms(model.effects, robot.n_joints)
        identified = model.parameters == "identified"
        self.problem = make_problem(
            signals, torque, robot=robot, rigid_body=identified, terms=terms
        )
        base = self.problem.fit(terms, passes=3)
        self.problem.with_fit(base)
        self._sigma = base.noise
        self._target = self.problem.target
        self._pool = catalogue_candidates(self.problem, list_effects())
        self._screen = Screen(self.problem, self._sigma, self._pool, self._target)
        self.added: list[tuple[Term, ...]] = []
        self._fits: list[Fit] = [base]
        self._drops: Array | None = None
        self.history: list[dict[str, Any]] = [self._entry(None)]

    # ------------------------------------------------------------------ what is seen
    @property
    def terms(self) -> list[Term]:
        """Effects of the model as it is now."""
        return [*self.problem.terms, *(t for step in self.added for t in step)]

    @property
    def trajectories(self) -> list[int]:
        """Numbers of the trajectories."""
        return [int(k) for k in np.unique(self.problem.signals.trajectory)]

    def curves(self, joint: int, trajectory: int) -> dict[str, list[float]]:
        """Measured torque, and the model as given and as it is now.

        Parameters
        ----------
        joint : int
            Joint, counted from 1.
        trajectory : int
            Trajectory.

        Returns
        -------
        dict
            ``time`` (s), ``measured``, ``given``, ``now`` (N m or N); few points, peaks kept.
        """
        j = self._joint(joint)
        here = np.flatnonzero(self.problem.signals.trajectory == trajectory)
        if not len(here):
            raise EffectError(f"no trajectory {trajectory}; there are {self.trajectories}")
        measured = self.torque[here, j]
        given, now = (measured - self._residual(fit, j)[here] for fit in self._ends())
        whole = [slice(0, len(here))]
        rows = rows_with_peaks([measured, measured - given, measured - now], whole, POINTS // 6)[0]
        time = self.problem.signals.clock[here]
        return {
            "time": time[rows].tolist(),
            "measured": measured[rows].tolist(),
            "given": given[rows].tolist(),
            "now": now[rows].tolist(),
        }

    def ranked(
        self,
        joint: int,
        trajectory: int | None = None,
        span: tuple[float, float] | None = None,
    ) -> list[RankedEffect]:
        """Effects that would lower the error of a joint, best first.

        Parameters
        ----------
        joint : int
            Joint, counted from 1.
        trajectory : int, optional
            With ``span``: where the model fails.
        span : tuple of float, s, optional
            Stretch of time within the trajectory; the ranking is by what an effect does there.

        Returns
        -------
        list of RankedEffect
        """
        j = self._joint(joint)
        model = self._screen.model([self.problem.term_rows(t) for t in self.terms])
        base = self._screen.held_out(model).sum()
        if self._drops is None:
            self._drops = base - self._screen.step(model).sum(1)
        residual = self._fits[-1].residual[j]
        own = max(float(residual @ residual) / self._sigma[j] ** 2, 1e-300)
        rows = self._rows_in(j, trajectory, span)
        best: dict[str, tuple[float, Candidate]] = {}
        for candidate, drop in zip(self._pool, self._drops, strict=True):
            if j not in candidate.rows or not np.isfinite(drop) or drop <= 0:
                continue
            if drop > best.get(candidate.kind, (0.0, candidate))[0]:
                best[candidate.kind] = (float(drop), candidate)
        found = []
        for kind, (drop, candidate) in best.items():
            effect = get_effect(kind)
            found.append(
                RankedEffect(
                    kind,
                    effect.title,
                    effect.formula,
                    tuple(k + 1 for k in candidate.joints),
                    min(float(drop / own), 1.0),
                    self._explains(candidate, j, residual, rows),
                )
            )
        return sorted(found, key=lambda r: _rank(r, span is not None))[:RANKED]

    # ------------------------------------------------------------------ what is done
    def add(self, kind: str, joint: int) -> dict[str, Any]:
        """Add an effect where it helps a joint most, and fit the model again.

        Parameters
        ----------
        kind : str
            Kind of the catalogue.
        joint : int
            Joint, counted from 1.

        Returns
        -------
        dict
            ``added``, ``joints`` and held-out ``rmse`` of every joint, N m or N.

        Raises
        ------
        EffectError
            The effect does not act on this joint, or is in the model already.
        """
        j = self._joint(joint)
        self.ranked(joint)
        assert self._drops is not None
        pool = [
            (d, c) for d, c in zip(self._drops, self._pool, strict=True)
            if c.kind == kind and j in c.rows and c.term.joints not in self._taken(kind)
        ]  # fmt: skip
        if not pool:
            raise EffectError(
                f"{kind} cannot be added to joint {joint}: not shown, or there already"
            )
        candidate = max(pool, key=lambda item: item[0])[1]
        blocks = [self.problem.term_rows(t) for t in self.terms]
        refined = refine(self.problem, blocks, [candidate], self._sigma, self._target)
        return self._push(tuple(c.term for c in refined))

    def undo(self) -> dict[str, Any]:
        """Take the last addition back.

        Returns
        -------
        dict
            The step before.
        """
        if self.added:
            self.added.pop()
            self._fits.pop()
            self.history.pop()
            self._drops = None
        return self.history[-1]

    def fitted_model(self) -> RBDRegressor:
        """The model with everything added, fitted to the whole log.

        Returns
        -------
        RBDRegressor
        """
        terms = [t for step in self.added for t in step]
        return self.model.with_effects(terms).fit(*self.data)

    def script(self, logs: Sequence[str] = ("log.csv",), urdf: str = "robot.urdf") -> str:
        """Python that does the same without a browser.

        Parameters
        ----------
        logs : sequence of str
            Files of the log.
        urdf : str
            Description of the robot.

        Returns
        -------
        str
            A script that prints the held-out error before and after.
        """
        terms = [t for step in self.added for t in step]
        lines = [
            "from skidyn.datasets import read_log",
            "from skidyn.diagnosis import Settings, diagnose",
            "from skidyn.effects import Term",
            "from skidyn.rigid_body import RBDRegressor",
            "from skidyn.robots import Robot",
            "",
            f"robot = Robot.from_urdf({str(urdf)!r})",
            f"log = read_log({list(map(str, logs))!r}, robot=robot)",
            'tau = log[[f"tau{j + 1}" for j in range(robot.n_joints)]]',
            f"model = RBDRegressor(robot, {list(self.model.effects)!r}, {self.model.parameters!r})",
            "added = [",
            *(f"    Term({t.kind!r}, {t.joints!r}, {_literal(t.shape)})," for t in terms),
            "]",
            "better = model.with_effects(added)",
            "only_compare = Settings(max_findings=0)",
            'for name, candidate in (("given", model), ("better", better)):',
            "    print(name, diagnose(candidate, log, tau, settings=only_compare).rmse_before)",
            "better.fit(log, tau)",
            "",
        ]
        return "\n".join(lines)

    # ------------------------------------------------------------------ inside
    def _joint(self, joint: int) -> int:
        if not 1 <= joint <= self.robot.n_joints:
            raise EffectError(f"no joint {joint}; the robot has joints 1 to {self.robot.n_joints}")
        return joint - 1

    def _taken(self, kind: str) -> set[tuple[int, ...]]:
        return {t.joints for t in self.terms if t.kind == kind}

    def _ends(self) -> tuple[Fit, Fit]:
        return self._fits[0], self._fits[-1]

    def _residual(self, fit: Fit, joint: int) -> Array:
        return (self.problem.torque - self.problem.explained(fit))[:, joint]

    def _push(self, terms: tuple[Term, ...]) -> dict[str, Any]:
        self.added.append(terms)
        self._fits.append(self.problem.fit(self.terms, sigma=self._fits[-1].noise))
        self._drops = None
        self.history.append(self._entry(terms[0]))
        return self.history[-1]

    def _entry(self, term: Term | None) -> dict[str, Any]:
        blocks = [self.problem.term_rows(t) for t in self.terms]
        errors = profile_error(self.problem, blocks, self._sigma, self._target).sum(0)
        rmse = np.sqrt(errors / np.maximum(self.problem.rows.counts, 1))
        return {
            "added": None if term is None else term.kind,
            "joints": [] if term is None else [j + 1 for j in term.joints],
            "rmse": [float(x) for x in rmse],
        }

    def _rows_in(
        self, joint: int, trajectory: int | None, span: tuple[float, float] | None
    ) -> Array:
        rows = self.problem.rows
        inside = np.ones(len(rows.time[joint]), dtype=bool)
        if trajectory is not None:
            inside &= rows.trajectory[joint] == trajectory
        if span is not None:
            inside &= (rows.time[joint] >= min(span)) & (rows.time[joint] <= max(span))
        return inside

    def _explains(self, candidate: Candidate, joint: int, residual: Array, rows: Array) -> float:
        """Share of the squared residual in some rows that an effect alone takes away."""
        if rows.sum() < 4:
            return 0.0
        block, y = candidate.rows[joint][rows], residual[rows]
        left = y - block @ np.linalg.lstsq(block, y, rcond=1e-8)[0]
        return float(1 - left @ left / max(y @ y, 1e-300))


def _rank(effect: RankedEffect, here: bool) -> tuple[float, int]:
    """Best first; what does as much to within a twentieth is ordered by simplicity."""
    worth = effect.drop * effect.drop_here if here else effect.drop
    return -round(20 * worth) / 20, get_effect(effect.kind).simplicity


def _literal(shape: Any) -> str:
    """A shape as Python source."""
    plain = {k: v.item() if isinstance(v, np.generic) else v for k, v in dict(shape).items()}
    return repr(plain)
