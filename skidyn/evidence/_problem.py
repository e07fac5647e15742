# SPDX-License-Identifier: BSD-3-Clause
"""The regression problem of a diagnosis: rows, folds, the present model and its fit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain, groupby, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from skidyn._cores import each
from skidyn._last import LastResults
from skidyn._progress import tell
from skidyn._signals import Array, Signals
from skidyn.effects import Term, TermSum, get_effect
from skidyn.evidence._fit import Fit, FittedAlone, fit_weighted
from skidyn.evidence._folds import nearest_folds
from skidyn.evidence._motion_rows import RowsAndFolds, read_motion, rows_and_folds
from skidyn.evidence._rigid_rows import independent_columns, regressor_rows
from skidyn.evidence._rows import WINDOW, Rows, averaged, interpolation
from skidyn.robots import Robot, base_parameter_index

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Samples per window that are enough for a smooth function; at first, others are omitted.
ENOUGH_SAMPLES = 16
#: Number of terms of many joints that one process computes at a time.
TOGETHER = 8


@dataclass
class Problem:
    """Torque to be explained by a rigid body and terms, as averaged rows.

    Attributes
    ----------
    robot : Robot or None
        Robot, whose rigid body is part of the model if ``rigid_body`` is True.
    signals : Signals
        Smoothed motion with the load and model torque of the current fit.
    torque : ndarray of shape (n_samples, n_joints)
        Measured torque minus the part that is not fitted: the rigid body with the parameters of the
        URDF, or the prediction of a given regressor. Identified parameters are corrections to the
        URDF's, so that parameters that the data does not determine keep the values of the URDF.
    terms : TermSum
        Effects that the user's model contains already.
    rows : Rows
        Averaging windows.
    fold : list of ndarray
        Fold of every row, per joint; rows are sorted by it.
    n_folds : int
        Number of folds.
    whole_trajectories : bool
        Whether folds are whole trajectories.
    rigid_body : bool
        Whether rigid-body parameters are identified together with the effects.
    logged : Signals or None
        Logged motion.
    measured : ndarray of shape (n_samples, n_joints) or None, N m or N
        Torque as given, from which nothing was subtracted.
    of_residual : bool
        Whether the torque is the residual of a regressor, and not that of the robot.
    last : LastResults
        Results that are asked for again; shared by copies.
    with_like_rows : callable or None
        Function that returns another problem, with given terms, with rows of the kind that this one
        has, if they are not the usual ones.
    """

    robot: Robot | None
    signals: Signals
    torque: Array
    terms: TermSum
    rows: Rows
    fold: list[NDArray[np.int64]]
    n_folds: int
    whole_trajectories: bool
    rigid_body: bool
    rigid_index: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    rigid_rows: list[Array] = field(default_factory=list)
    logged: Signals | None = None
    measured: Array | None = None
    of_residual: bool = False
    _cache: dict[Term, dict[int, Array]] = field(default_factory=dict, repr=False)
    last: LastResults = field(default_factory=LastResults, repr=False)
    with_like_rows: Callable[[Problem, Iterable[Term]], Problem] | None = None
    _thinned: dict[int, list[csr_matrix]] = field(default_factory=dict, repr=False)

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return self.signals.n_joints

    @property
    def target(self) -> list[Array]:
        """Averaged torque of every joint."""
        return [self.rows.average(self.torque[:, j], j) for j in range(self.n_joints)]

    def term_rows(self, term: Term) -> dict[int, Array]:
        """Averaged columns of a term, per joint on which it acts."""
        rows = self._cache.get(term)
        if rows is None:
            rows = self._cache[term] = self._averaged(term, self._step(term))
        return rows

    def screening_rows(self, term: Term) -> dict[int, Array]:
        """As :meth:`term_rows`, but of an unknown function from only as many samples as needed.

        A window of a log at 1 kHz holds 125 samples. A function as smooth as these has the same
        mean over every seventh sample; one that jumps or oscillates does not.
        """
        step = self._skipped(term)
        if step <= self._step(term) or term in self._cache:
            return self.term_rows(term)
        return self._averaged(term, step)

    def keep(self, terms: Iterable[Term]) -> None:
        """Remove the averaged columns of all terms but some from the cache."""
        wanted = set(terms)
        self._cache = {term: rows for term, rows in self._cache.items() if term in wanted}

    def _step(self, term: Term) -> int:
        """Number of samples of which one is enough for a term; fine waves need all samples."""
        return 1 if term.effect.search == "spectrum" else self.rows.step

    def _skipped(self, term: Term) -> int:
        """Step between samples that is small enough for a term at first."""
        if self.signals.time is None or not term.effect.nameless:
            return 1
        return int(self.signals.rate * WINDOW / ENOUGH_SAMPLES)

    def _averaged(self, term: Term, step: int) -> dict[int, Array]:
        signals, weights = self.sampled(step)
        columns = term.torque_columns(signals)
        return {j: averaged(weights[j], block) for j, block in columns.items()}

    @property
    def few(self) -> Signals:
        """The signals at the samples at which columns are computed."""
        return self.sampled(self.rows.step)[0]

    def sampled(self, step: int) -> tuple[Signals, list[csr_matrix]]:
        """The signals at one of every ``step`` samples, and the weights of the rows, by joint."""
        if step < 2:
            return self.signals, self.rows.weights
        _, few = self.signals.once(
            ("thinned", step), lambda: self.signals.thinned(step), of_fit=True
        )
        if step not in self._thinned:
            between = interpolation(self.signals.segments, few.segments, step)
            self._thinned[step] = self.rows.thinned(between)
        return few, self._thinned[step]

    def prepare(
        self, terms: Sequence[Term], screening: bool = False, text: str = ""
    ) -> list[dict[int, Array]]:
        """Rows of many terms, on all cores that may be used.

        Parameters
        ----------
        terms : sequence of Term
            Terms; quantities shared by neighbours, such as inputs that several kinds need for a
            joint, are computed once.
        screening : bool, default=False
            Return the rows of :meth:`screening_rows` instead of :meth:`term_rows`.
        text : str, default=""
            Description of the task for progress reports.

        Returns
        -------
        list of dict of int to ndarray of shape (n_rows_j, n_coefficients)
        """
        of = self.screening_rows if screening else self.term_rows
        new = [t for t in dict.fromkeys(terms) if t not in self._cache]
        if any({"model_torque", "motor_torque"} & set(t.effect.needs) for t in new):
            _ = self.few.model_torque  # before processes start, which would all compute it
        groups = _pieces(new)
        found = each(lambda group: [of(term) for term in group], groups, text, short=True)
        rows = dict(zip(chain(*groups), chain(*found), strict=True))
        whole = (t for t in rows if not screening or self._skipped(t) <= self._step(t))
        self._cache |= {t: rows[t] for t in whole}
        return [rows[t] if t in rows else self._cache[t] for t in terms]

    def average(self, columns: dict[int, Array]) -> dict[int, Array]:
        """Averaged rows of columns given at every sample."""
        return {j: averaged(self.rows.weights[j], block) for j, block in columns.items()}

    def design(self, blocks: Sequence[dict[int, Array]]) -> list[Array]:
        """Rigid-body columns and blocks of columns side by side, per joint."""
        start = self.rigid_rows[0].shape[1]
        ends = np.cumsum([start, *map(width, blocks)]).tolist()
        places = [slice(a, b) for a, b in pairwise(ends)]
        design = [np.zeros((len(rows), ends[-1])) for rows in self.rigid_rows]
        for j, rows in enumerate(design):
            rows[:, :start] = self.rigid_rows[j]
            for own, block in zip(places, blocks, strict=True):
                if j in block:
                    rows[:, own] = block[j]
        return design

    def soft(self, terms: Sequence[Term]) -> list[tuple[slice, float]]:
        """Coefficients of the flexible functions among some terms, and how they are drawn to 0."""
        places = TermSum(terms).slices(len(self.rigid_index))
        return [(own, term.effect.softness) for term, own in places if term.effect.softness]

    def with_base_columns(self) -> Problem:
        """The same problem with the columns of all base parameters, also undetermined ones."""
        if not self.rigid_body or self.robot is None:
            return self
        base = base_parameter_index(self.robot)
        if len(base) == len(self.rigid_index):
            return self
        return with_rigid_columns([self], base)[0]

    def fit(self, terms: Iterable[Term], sigma: Array | None = None, passes: int = 1) -> Fit:
        """Weighted least squares of the rigid body and terms.

        Parameters
        ----------
        terms : iterable of Term
            Every effect of the model.
        sigma : ndarray of shape (n_joints,), optional
            Noise of one row of every joint; found from a fit of each joint by itself if None.
        passes : int, default=1
            Number of times that the noise is estimated from the residual and the fit repeated.
        """
        terms = TermSum(terms)
        blocks = [self.term_rows(t) for t in terms]
        design, target = self.design(blocks), self.target
        if sigma is None:
            alone = self._fitted_alone(blocks, target, design)
            sigma = np.array([own.noise(len(y)) for own, y in zip(alone, target, strict=True)])
        fit = fit_weighted(terms, design, target, sigma)
        for k in range(1, passes):
            tell("Fitting", k / passes)
            fit = fit_weighted(terms, design, target, fit.noise)
        return fit

    def own_noise(self, terms: Iterable[Term]) -> Array:
        """Noise of one row of every joint, each fitted by itself, (n_joints,).

        An effect missing on a joint makes its residual in the fit of all joints large, which lowers
        the weight of the joint, so that the residual grows further. In a fit of the joint alone the
        residual is as small as the model permits.

        Parameters
        ----------
        terms : iterable of Term
            Every effect of the model.
        """
        blocks, target = [self.term_rows(t) for t in terms], self.target
        used = self.rigid_rows[0].shape[1] + sum(map(width, blocks))
        alone = self._fitted_alone(blocks, target)
        return np.array(
            [own.noise(max(1, len(y) - used), len(y)) for own, y in zip(alone, target, strict=True)]
        )

    def _fitted_alone(
        self,
        blocks: Sequence[dict[int, Array]],
        target: list[Array],
        design: list[Array] | None = None,
    ) -> list[FittedAlone]:
        """Fit of every joint by itself; a search asks for the same one several times."""
        made_of = [*self.rigid_rows, *(b[j] for b in blocks for j in b)]

        def make() -> list[FittedAlone]:
            pairs = zip(self.design(blocks) if design is None else design, target, strict=True)
            return [FittedAlone.of(a, y) for a, y in pairs]

        fits: list[FittedAlone] = self.last.get("alone", made_of, make, target)
        return fits

    def sample_folds(self, joint: int, rows: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
        """Fold of samples, that of the nearest averaged row of a joint.

        Parameters
        ----------
        joint : int
            Joint, from 0.
        rows : ndarray of shape (n,) of int, optional
            Which samples; all by default.

        Returns
        -------
        ndarray of shape (n,) of int
        """
        rows = np.arange(self.signals.n_samples) if rows is None else rows
        trajectory, time = self.rows.trajectory[joint], self.rows.time[joint]
        return nearest_folds(self.signals, rows, trajectory, time, self.fold[joint])

    def fit_own(self, passes: int = 3) -> Fit:
        """Fit of the given model, whose load and torque are then available to all terms.

        Parameters
        ----------
        passes : int, default=3
            As in :meth:`fit`.
        """
        free = [t for t in self.terms if not t.effect.follows_fit]
        if len(free) < len(self.terms):  # the others start with the load of a model without them
            self.set_fit(self.fit(free, passes=passes))
        fit = self.fit(self.terms, passes=passes)
        self.set_fit(fit)
        return fit

    def inertial_parameters(self, fit: Fit) -> Array | None:
        """Rigid-body parameters of a fit: the URDF's with the base parameters corrected."""
        if self.robot is None:
            return None
        correction = self.correction(fit.coefficients)
        return self.robot.inertial_parameters + correction

    def correction(self, coefficients: Array) -> Array:
        """Change of the rigid-body parameters that coefficients represent, (n_bodies, 10)."""
        assert self.robot is not None
        change = np.zeros(10 * self.robot.n_bodies)
        change[self.rigid_index] = coefficients[: len(self.rigid_index)]
        return change.reshape(-1, 10)

    def rigid_torque(self, fit: Fit) -> Array:
        """Rigid-body torque of a fit at every sample, N m or N."""
        if self.robot is None:
            return np.zeros_like(self.torque)
        s = self.signals
        return self.robot.inverse_dynamics(
            s.q, s.dq, s.ddq, parameters=self.inertial_parameters(fit)
        )

    def term_torque(self, fit: Fit, terms: Iterable[Term] | None = None) -> Array:
        """Torque of some terms of a fit at every sample, N m or N."""
        wanted = None if terms is None else set(terms)
        torque = np.zeros_like(self.torque)
        for term, own in fit.terms.slices(len(self.rigid_index)):
            if wanted is None or term in wanted:
                _add(torque, self.signals, term, fit.coefficients[own])
        return torque

    def explained(self, fit: Fit) -> Array:
        """Part of :attr:`torque` that a fit explains at every sample, N m or N; read only."""
        s = self.signals
        made_of = [fit.coefficients, self.rigid_index, s.q, s.dq, s.ddq, s.time, s.trajectory]
        if any(t.effect.follows_fit or "robot" in t.effect.needs for t in fit.terms):
            made_of += [s.load, s.model_torque, s.inertial_parameters]

        def make() -> Array:
            torque = self.term_torque(fit)
            if self.rigid_body:
                assert self.robot is not None
                change = self.correction(fit.coefficients)
                torque += self.robot.inverse_dynamics(s.q, s.dq, s.ddq, parameters=change)
            torque.flags.writeable = False  # it is returned again
            return torque

        torque: Array = self.last.get("explained", made_of, make, [fit.terms])
        return torque

    def set_fit(self, fit: Fit) -> None:
        """Set the load and the model torque of a fit for the effects that need them."""
        load = self.rigid_torque(fit)
        places = list(fit.terms.slices(len(self.rigid_index)))
        shares = [(term, fit.coefficients[own]) for term, own in places]
        for term, coefficients in shares:
            if term.effect.on_bodies:
                _add(load, self.signals, term, coefficients)
        # An effect of the torque sensor acts on the torque before the sensor.
        others = [(t, b) for t, b in shares if not (t.effect.on_bodies or t.effect.sees_model)]
        torques = _Torques(self.signals, load, others)
        self.signals = self.signals.with_(
            load=load,
            model_torque=lambda: torques()[0],
            smooth_torque=lambda: torques()[1],
            inertial_parameters=self.inertial_parameters(fit),
        )
        following = {k for k in {t.kind for t in self._cache} if get_effect(k).follows_fit}
        self._cache = {t: rows for t, rows in self._cache.items() if t.kind not in following}


class _Torques:
    """Torque of a model with and without dry friction, computed once if it is needed.

    Effects that move a link need only the load, and short windows of a long log much memory.
    """

    def __init__(self, signals: Signals, load: Array, shares: Sequence[tuple[Term, Array]]) -> None:
        self._made_of: Any = (signals, load, shares)
        self._found: tuple[Array, Array] | None = None

    def __call__(self) -> tuple[Array, Array]:
        if self._found is None:
            signals, load, shares = self._made_of
            dry, smooth = np.zeros_like(load), np.zeros_like(load)
            for term, coefficients in shares:
                _add(dry if term.is_dry else smooth, signals, term, coefficients)
            self._found = load + dry + smooth, load + smooth
            self._made_of = None  # the previous signals are not needed any more
        return self._found


def _add(torque: Array, signals: Signals, term: Term, coefficients: Array) -> None:
    for j, block in term.torque_columns(signals).items():
        torque[:, j] += block @ coefficients


def with_rigid_columns(problems: Sequence[Problem], index: NDArray[np.int64]) -> list[Problem]:
    """The same problems of one robot with the columns of some rigid-body parameters."""
    return [
        replace(problem, rigid_index=index, rigid_rows=rows)
        for problem, rows in zip(problems, regressor_rows(problems, index), strict=True)
    ]


def hysteresis_joints(terms: Iterable[Term]) -> list[int]:
    """Joints, from 0, whose friction at reversals some of the terms describe."""
    joints = {j for t in terms if t.effect.family == "hysteresis" for j in t.places}
    return sorted(joints)


def _pieces(terms: Sequence[Term]) -> list[list[Term]]:
    """Neighbours that share inputs; those of many joints take longest: first, and in parts."""
    groups = [list(g) for _, g in groupby(terms, key=lambda t: (t.effect.needs, t.places))]
    long = [group for group in groups if len(group[0].places) > 2]
    parts = [group[k : k + TOGETHER] for group in long for k in range(0, len(group), TOGETHER)]
    return [*parts, *(group for group in groups if len(group[0].places) <= 2)]


def width(block: dict[int, Array]) -> int:
    """Number of columns of a block."""
    return int(next(iter(block.values())).shape[1])


def make_problem(
    signals: Signals,
    torque: Array,
    *,
    robot: Robot | None,
    rigid_body: bool,
    terms: Iterable[Term],
    smooth: bool = True,
    subtract_urdf: bool = True,
    reversals: Sequence[int] = (),
    weight: Array | None = None,
) -> Problem:
    """Set up rows, folds and rigid-body columns.

    Parameters
    ----------
    signals : Signals
        Logged motion.
    torque : ndarray of shape (n_samples, n_joints), N m or N
        Torque to be explained.
    robot : Robot or None
        Robot.
    rigid_body : bool
        Whether rigid-body parameters are to be identified.
    terms : iterable of Term
        Effects of the user's model.
    smooth : bool, default=True
        Derive velocity and acceleration from the positions; if False, use the given ones.
    subtract_urdf : bool, default=True
        Subtract the torque of the URDF's rigid body; False if ``torque`` is a residual already.
    reversals : sequence of int, default=()
        Joints, from 0, whose rows reach up to the reversals. Only a model that describes friction
        there, one of the family ``"hysteresis"``, can be tested on them.
    weight : ndarray of shape (n_samples,), optional
        Weight of every sample; those of weight 0 enter no row.
    """
    motion = read_motion(signals, smooth, torque)
    if weight is not None:
        motion = motion.with_(valid=motion.usable & (weight > 0)[:, None])
    rows, fold, n_folds, whole = rows_and_folds(motion, reversals, weight)
    problem = Problem(
        robot,
        motion.with_(robot=robot),
        torque,
        TermSum(terms),
        rows,
        fold,
        n_folds,
        whole,
        rigid_body and robot is not None,
    )
    problem.logged, problem.measured = signals, torque
    problem.of_residual = not subtract_urdf
    problem.rigid_rows = [np.zeros((n, 0)) for n in rows.counts]
    if subtract_urdf and robot is not None:
        s = problem.signals
        problem.torque = torque - robot.inverse_dynamics(s.q, s.dq, s.ddq)
    if problem.rigid_body:
        _add_rigid_body(problem)
    return problem


def with_reversals(problem: Problem, terms: Iterable[Term], joints: Sequence[int]) -> Problem:
    """The same problem with rows up to the reversals, for a model with other terms.

    Parameters
    ----------
    problem : Problem
        Rows without reversals.
    terms : iterable of Term
        Effects of the model.
    joints : sequence of int
        Joints, from 0, whose rows reach up to the reversals.
    """
    alike = partial(with_reversals, joints=joints)
    return _with_rows(problem, terms, rows_and_folds(problem.signals, joints), alike)


def with_short_windows(problem: Problem, terms: Iterable[Term], window: float) -> Problem:
    """The same problem with rows averaged over shorter windows, for a model with other terms.

    Parameters
    ----------
    problem : Problem
        Problem with a clock.
    terms : iterable of Term
        Effects of the model.
    window : float, s
        Width of the windows.
    """
    alike = partial(with_short_windows, window=window)
    return _with_rows(problem, terms, rows_and_folds(problem.signals, (), window=window), alike)


def _with_rows(
    problem: Problem,
    terms: Iterable[Term],
    made: RowsAndFolds,
    alike: Callable[[Problem, Iterable[Term]], Problem],
) -> Problem:
    rows, fold, n_folds, whole = made
    other = replace(
        problem,
        terms=TermSum(terms),
        rows=rows,
        fold=fold,
        n_folds=n_folds,
        whole_trajectories=whole,
        rigid_rows=[np.zeros((n, 0)) for n in rows.counts],
        rigid_index=np.zeros(0, dtype=np.int64),
        with_like_rows=alike,
        _cache={},
        _thinned={},
    )
    if other.rigid_body:
        _add_rigid_body(other)
    return other


def _add_rigid_body(problem: Problem) -> None:
    """Average the torque regressor and keep its independent columns."""
    assert problem.robot is not None
    base = base_parameter_index(problem.robot)
    (rows,) = regressor_rows([problem], base)
    shown = independent_columns(np.vstack(rows))
    problem.rigid_index = base[shown]
    problem.rigid_rows = (
        rows
        if len(shown) == len(base)
        else [np.ascontiguousarray(block[:, shown]) for block in rows]
    )
