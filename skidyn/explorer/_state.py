# SPDX-License-Identifier: BSD-3-Clause
"""The model of a session step by step: additions, fits and quantities derived from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._exceptions import EffectError
from skidyn._signals import Array, read_signals
from skidyn._text import joints_of
from skidyn.diagnosis import Candidate, catalogue_candidates, noise_level, own_terms
from skidyn.effects import Term, TermSum, searched_kinds
from skidyn.evidence import make_problem
from skidyn.explorer._beside import Offer, Ripple, fit_ripple, loads, ripples
from skidyn.explorer._ranking import FoldedModel, HeldOutRows, Ranking
from skidyn.explorer._samples import Samples
from skidyn.explorer._sure import Margin
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot


@dataclass
class Step:
    """The model after one click, with quantities computed from it."""

    terms: tuple[Term, ...]
    model: FoldedModel
    noise: Array  # of one row of every joint, N m or N
    residual: Array  # held out, at every sample, N m or N
    entry: dict[str, Any]
    coarse: Candidate | None = None
    margin: Margin = field(default_factory=Margin)
    rows: dict[int, HeldOutRows] = field(default_factory=dict)
    offers: list[Offer] | None = None
    ripples: dict[Term, Ripple] = field(default_factory=dict)


def is_fine(term: Term) -> bool:
    """Whether an effect is faster than averaged rows."""
    return term.effect.search == "spectrum"


class State:
    """The problem of a log, and the steps from the given to the present model."""

    def __init__(self, model: RBDRegressor, X: Any, tau: Any) -> None:
        self.model, self.data = model, (X, tau)
        robot = model.robot if isinstance(model.robot, Robot) else Robot.from_urdf(model.robot)
        self.robot = robot
        signals, torque = read_signals(X, tau, robot, trajectory=model.trajectory, time=model.time)
        self.torque = torque
        terms = own_terms(model, robot, X, tau)
        identified = model.parameters == "identified"
        self.problem = make_problem(
            signals, torque, robot=robot, rigid_body=identified, terms=terms
        )
        base = self.problem.fit_own()
        self._target = self.problem.target
        self._pool = catalogue_candidates(self.problem, searched_kinds())
        self._ranking = Ranking(self.problem, self._pool, self._target)
        self._samples = Samples(self.problem)
        self._steps = [self._step((), base.terms, base.sigma, None)]

    @property
    def added(self) -> list[tuple[Term, ...]]:
        """Additions, step by step."""
        return [step.terms for step in self._steps[1:]]

    @property
    def history(self) -> list[dict[str, Any]]:
        """Held-out error of every joint (``rmse``, N m or N), at first and after every step.

        It is that of :func:`skidyn.diagnosis.diagnose` (``rmse_before``): sliding samples, each
        under a fit that left its fold out.

        ``added`` is the kind of the added effect, ``joints`` are the joints on which it acts, and
        ``joint`` is the joint for which it was added, counted from 1.
        """
        return [step.entry for step in self._steps]

    @cached_property
    def noise(self) -> Array:
        """Noise of torque and position sensors, N m or N, as in a diagnosis."""
        return noise_level(self.problem, self._steps[0].residual)

    @property
    def worst(self) -> int:
        """Joint with the largest ratio of held-out error to noise in the given model, from 1."""
        error = np.array(self.history[0]["rmse"])
        return int(np.argmax(error / np.maximum(self.noise, 1e-9 * np.abs(self.torque).max()))) + 1

    @property
    def refinable(self) -> bool:
        """Whether the last addition still has the shape of the grid, for :meth:`refine`."""
        return self._steps[-1].coarse is not None

    @property
    def terms(self) -> list[Term]:
        """Effects of the present model."""
        return [*self.problem.terms, *(t for step in self.added for t in step)]

    @property
    def trajectories(self) -> list[int]:
        """Numbers of the trajectories."""
        return [int(k) for k in np.unique(self.problem.signals.trajectory)]

    def _offers(self, joint: int) -> list[Offer]:
        """Ripples and loads that would reduce a joint's error; computed once."""
        step = self._steps[-1]
        if step.offers is None:
            blocks = [self.problem.term_rows(t) for t in self.terms if not is_fine(t)]
            step.offers = [
                *ripples(self.problem, step.residual, self._samples.fold),
                *loads(self.problem, blocks, step.noise, self._target),
            ]
        return [o for o in step.offers if o.drop[joint] > 0 and not self._has(o.candidate)]

    def _joint(self, joint: int) -> int:
        if not 1 <= joint <= self.robot.n_joints:
            raise EffectError(f"no joint {joint}; the robot has {joints_of(self.robot.n_joints)}")
        return joint - 1

    def _check_trajectory(self, trajectory: int) -> None:
        if trajectory not in self.trajectories:
            raise EffectError(f"no trajectory {trajectory}; there are {self.trajectories}")

    def _has(self, candidate: Candidate) -> bool:
        return any((t.kind, t.places) == candidate.site for t in self.terms)

    def _of_samples(self, joint: int, found: HeldOutRows) -> float:
        """Share of the residual of averaged rows in the squared error of samples."""
        weight = np.asarray(self.problem.rows.weights[joint].sum(axis=1)).ravel()
        mean = float(np.mean((found.residual / weight) ** 2))
        return float(min(mean / max(self.history[-1]["rmse"][joint] ** 2, 1e-300), 1.0))

    def _held_out(self, joint: int) -> HeldOutRows:
        step = self._steps[-1]
        if joint not in step.rows:
            step.rows[joint] = self._ranking.held_out(step.model, joint)
        return step.rows[joint]

    def _push(self, candidate: Candidate, joint: int, over: Margin) -> None:
        new = (candidate.term,)
        noise = self._steps[-1].noise
        self._steps.append(self._step(new, (*self.terms, *new), noise, joint))
        self._steps[-1].coarse = candidate if candidate.n_shapes else None
        self._steps[-1].margin = over

    def _step(
        self, new: tuple[Term, ...], terms: tuple[Term, ...], sigma: Array, joint: int | None
    ) -> Step:
        rest = [t for t in terms if not is_fine(t)]
        model = self._ranking.model(
            [self.problem.term_rows(t) for t in rest], sigma, self._of_recordings(rest)
        )
        left = [f.solution for f in model.fits]
        residual = self._samples.residual(rest, left, model.whole.solution)
        fitted: dict[Term, Ripple] = {}
        for term in filter(is_fine, terms):
            fitted[term] = fit_ripple(self.problem, term, residual, self._samples.fold)
            residual[:, term.places[0]] -= fitted[term].torque
        sliding = self.problem.rows.sliding
        squares = np.sum(residual**2 * sliding, axis=0)
        rmse = np.sqrt(squares / np.maximum(sliding.sum(axis=0), 1))
        entry = {
            "added": new[0].kind if new else None,
            "joint": joint,
            "joints": list(new[0].joints) if new else [],
            "rmse": [float(x) for x in rmse],
        }
        return Step(new, model, self._ranking.noise(model), residual, entry, ripples=fitted)

    def _of_recordings(self, terms: Sequence[Term]) -> NDArray[np.bool_]:
        """Coefficients that only one recording can identify, which are not held out with it."""
        rigid = len(self.problem.rigid_index)
        own = np.zeros(rigid + TermSum(terms).width, dtype=bool)
        for term, place in TermSum(terms).slices(rigid):
            own[place] = term.trajectories is not None
        return own
