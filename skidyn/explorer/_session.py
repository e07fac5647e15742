# SPDX-License-Identifier: BSD-3-Clause
"""State and actions of the explorer, without a browser."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._exceptions import EffectError
from skidyn._signals import Array, read_signals
from skidyn._text import measure
from skidyn.diagnosis import (
    Candidate,
    catalogue_candidates,
    noise_level,
    own_terms,
    parameter_intervals,
    refine,
    variance_inflation,
)
from skidyn.effects import Term, TermSum, get_effect, list_effects
from skidyn.evidence import jackknife, make_problem
from skidyn.explorer._beside import Offer, Ripple, fit_ripple, loads, ripples
from skidyn.explorer._ranking import FoldedModel, HeldOutRows, Ranking
from skidyn.explorer._samples import Samples
from skidyn.explorer._script import script
from skidyn.explorer._sure import Margin, margin, sure_told
from skidyn.identification import RBDRegressor
from skidyn.report import rows_with_peaks

#: Parameters of an addition that are told, and half the width of a 95 % interval.
TOLD, NORMAL = 3, 1.96
#: Points of a curve, and effects in a ranking.
POINTS, RANKED = 1500, 8
#: A click stands for this long, s, and for at least so many averaged rows.
STRETCH, LEAST_ROWS = 1.0, 8
#: An effect that takes less of the squared error of samples, held out, is not listed.
LEAST_DROP = 0.02


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
        Share of the squared held-out residual of the joint asked about that it takes away, the rest
        of the model fitted beside it. The residual is averaged over the windows of the fit, which
        takes most of the noise away.
    drop_here : float
        The same in the chosen stretch of time; as ``drop`` where none is chosen.
    trajectories : tuple of int, default=()
        Recordings that have it, of a payload or a force at the tool; empty for all. Such an effect
        is judged on interleaved quarters of the recordings, a torque ripple on single samples; the
        drop of both is that of the whole log.

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

    def __init__(self, model: RBDRegressor, X: Any, tau: Any) -> None:
        from skidyn.robots import Robot

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
        self._pool = catalogue_candidates(self.problem, list_effects())
        self._ranking = Ranking(self.problem, self._pool, self._target)
        self._samples = Samples(self.problem)
        self._steps = [self._step((), base.terms, base.sigma, None)]

    # ------------------------------------------------------------------ what is seen
    @property
    def added(self) -> list[tuple[Term, ...]]:
        """What was added, step by step."""
        return [step.terms for step in self._steps[1:]]

    @property
    def history(self) -> list[dict[str, Any]]:
        """Held-out error of every joint (``rmse``, N m or N) as given and after every step.

        It is that of :func:`skidyn.diagnosis.diagnose` (``rmse_before``): sliding samples, each
        under a fit that left its fold out.

        ``added`` is the kind that was added, ``joints`` where it acts and ``joint`` the joint for
        which it was added, counted from 1.
        """
        return [step.entry for step in self._steps]

    @cached_property
    def noise(self) -> Array:
        """Noise of torque and position sensors, N m or N, as a diagnosis takes it."""
        return noise_level(self.problem, self._steps[0].residual)

    @property
    def worst(self) -> int:
        """Joint whose held-out error as given is largest over its noise, counted from 1."""
        error = np.array(self.history[0]["rmse"])
        return int(np.argmax(error / np.maximum(self.noise, 1e-9 * np.abs(self.torque).max()))) + 1

    def sizes(self) -> list[str]:
        """What was added in numbers: parameters with half their 95 % intervals, step by step.

        Returns
        -------
        list of str
            Such as ``"k = 3.5 ± 0.4 N m/rad"``, one for each addition.
        """
        if not self.added:
            return []
        rest = [t for t in self.terms if not _is_fine(t)]
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
        """How sure the name of every addition is.

        Returns
        -------
        list of str
            Such as ``"90% sure of the name"``: as in a diagnosis, from what the best other effect
            would have taken instead, and from what is left on its joints now.
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

    @property
    def refinable(self) -> bool:
        """Whether the last addition still has the shape of the grid, and :meth:`refine` is due."""
        return self._steps[-1].coarse is not None

    @property
    def terms(self) -> list[Term]:
        """Effects of the model as it is now."""
        return [*self.problem.terms, *(t for step in self.added for t in step)]

    @property
    def trajectories(self) -> list[int]:
        """Numbers of the trajectories."""
        return [int(k) for k in np.unique(self.problem.signals.trajectory)]

    def curves(self, joint: int, trajectory: int) -> dict[str, list[float | None]]:
        """Measured torque, and the model as given and as it is now, held out.

        Parameters
        ----------
        joint : int
            Joint, counted from 1.
        trajectory : int
            Trajectory.

        Returns
        -------
        dict
            ``time`` (s), ``measured``, ``given``, ``now`` (N m or N); few points, peaks kept. The
            models are None where the joint rests or turns: these samples are not judged.
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
        """Held-out residual, averaged over the windows by which models are fitted and judged.

        Parameters
        ----------
        joint : int
            Joint, counted from 1.
        trajectory : int
            Trajectory.

        Returns
        -------
        dict
            ``time`` (s), ``given``, ``now`` (N m or N); None where the joint rests or turns.
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

    def stretch(self, joint: int, trajectory: int, time: float) -> tuple[float, float]:
        """The second around a moment, longer where a joint slides too little in it.

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
                f"joint {joint} does not slide in trajectory {trajectory}: effects cannot be "
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

        Every number is measured: the model is fitted with the effect to the other folds, and its
        residual compared with that of the model as it is.

        Parameters
        ----------
        joint : int
            Joint, counted from 1.
        trajectory : int, optional
            With ``span``: where the model fails.
        span : tuple of float, s, optional
            Stretch of time within the trajectory; the ranking is by the drop there.

        Returns
        -------
        list of RankedEffect
            The best candidate of every kind; of equal ones the simpler first.
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
            effect = candidate.term.effect
            best[candidate.kind] = RankedEffect(
                candidate.kind,
                effect.title,
                effect.formula,
                tuple(k + 1 for k in candidate.joints),
                float(drop[at]),
                float(here[at]),
            )
        for offer in self._offers(j):
            effect, share = offer.candidate.term.effect, float(offer.drop[j])
            which = offer.candidate.term.trajectories
            inside = trajectory is None or which is None or trajectory in which
            if share >= LEAST_DROP and inside:
                best[offer.candidate.kind] = RankedEffect(
                    offer.candidate.kind,
                    effect.title,
                    effect.formula,
                    tuple(k + 1 for k in offer.candidate.joints),
                    share,
                    share,
                    which or (),
                )
        return sorted(best.values(), key=_order)[:RANKED]

    def _offers(self, joint: int) -> list[Offer]:
        """Ripples and loads that would take something of a joint's error; worked out once."""
        step = self._steps[-1]
        if step.offers is None:
            blocks = [self.problem.term_rows(t) for t in self.terms if not _is_fine(t)]
            step.offers = [
                *ripples(self.problem, step.residual, self._samples.fold),
                *loads(self.problem, blocks, step.noise, self._target),
            ]
        return [o for o in step.offers if o.drop[joint] > 0 and not self._has(o.candidate)]

    # ------------------------------------------------------------------ what is done
    def add(self, kind: str, joint: int, *, refined: bool = True) -> dict[str, Any]:
        """Add an effect where it helps a joint most, and fit the model again.

        Parameters
        ----------
        kind : str
            Kind of the catalogue.
        joint : int
            Joint, counted from 1.
        refined : bool, default=True
            Search the shape parameters, beginning at the grid; False leaves that to
            :meth:`refine`, which is for a page that shows the first answer at once.

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
                "fit is not physical, or it is in the model already"
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
            blocks = [self.problem.term_rows(t) for t in self.terms if not _is_fine(t)]
            noise = self._steps[-1].noise
            better = refine(self.problem, blocks, [last.coarse], noise, self._target)[0]
            self._push(better, last.entry["joint"], last.margin)
            self._steps[-1].coarse = None
        return self.history[-1]

    def undo(self) -> dict[str, Any]:
        """Take the last addition back.

        Returns
        -------
        dict
            The step before.
        """
        if len(self._steps) > 1:
            self._steps.pop()
        return self.history[-1]

    def remove(self, step: int) -> dict[str, Any]:
        """Take one addition back, whatever was added after it.

        Parameters
        ----------
        step : int
            Place in :attr:`history`, from 1.

        Returns
        -------
        dict
            The last entry of :attr:`history`, all later additions fitted again.

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
        """The model with everything added, fitted to the whole log.

        Returns
        -------
        RBDRegressor
            A fitted copy; the model of the session stays as it is.
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
    ) -> str:
        """Python that does the same without a browser.

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

        Returns
        -------
        str
            A script that makes the same additions, prints the held-out errors shown here and saves
            the model.
        """
        clicks = [(entry["added"], entry["joint"]) for entry in self.history[1:]]
        return script(self.model, clicks, logs, urdf, joints, reading or {})

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

    # ------------------------------------------------------------------ inside
    def _joint(self, joint: int) -> int:
        if not 1 <= joint <= self.robot.n_joints:
            raise EffectError(f"no joint {joint}; the robot has joints 1 to {self.robot.n_joints}")
        return joint - 1

    def _check_trajectory(self, trajectory: int) -> None:
        if trajectory not in self.trajectories:
            raise EffectError(f"no trajectory {trajectory}; there are {self.trajectories}")

    def _has(self, candidate: Candidate) -> bool:
        return any((t.kind, t.places) == candidate.site for t in self.terms)

    def _of_samples(self, joint: int, found: HeldOutRows) -> float:
        """What the whole residual of averaged rows makes up of the squared error of samples."""
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
    ) -> _Step:
        rest = [t for t in terms if not _is_fine(t)]
        model = self._ranking.model(
            [self.problem.term_rows(t) for t in rest], sigma, self._of_recordings(rest)
        )
        left = [f.solution for f in model.fits]
        residual = self._samples.residual(rest, left, model.whole.solution)
        fitted: dict[Term, Ripple] = {}
        for term in filter(_is_fine, terms):
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
        return _Step(new, model, self._ranking.noise(model), residual, entry, ripples=fitted)

    def _of_recordings(self, terms: Sequence[Term]) -> NDArray[np.bool_]:
        """Coefficients that one recording alone can tell, and that are not held out with it."""
        rigid = len(self.problem.rigid_index)
        own = np.zeros(rigid + TermSum(terms).width, dtype=bool)
        for term, place in TermSum(terms).slices(rigid):
            own[place] = term.trajectories is not None
        return own

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


@dataclass
class _Step:
    """The model after one click, with what was worked out about it."""

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


def _is_fine(term: Term) -> bool:
    """Whether an effect is faster than averaged rows."""
    return term.effect.search == "spectrum"


def _ripple_intervals(term: Term, ripple: Ripple) -> dict[str, Any]:
    """Parameters of a ripple; its amplitude with a 95 % interval."""
    told: dict[str, Any] = dict(term.parameters(ripple.whole))
    size, spread = told["A"], NORMAL * float(jackknife(np.hypot(*ripple.left_out.T)))
    told["A"] = (size, size - spread, size + spread)
    return told


def _holes(values: Array) -> list[float | None]:
    """Numbers for JSON; None where there is none."""
    return [None if np.isnan(x) else float(x) for x in values]


def _order(effect: RankedEffect) -> tuple[float, int]:
    return -effect.drop_here, get_effect(effect.kind).simplicity
