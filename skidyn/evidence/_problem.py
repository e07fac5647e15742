# SPDX-License-Identifier: BSD-3-Clause
"""The regression problem of a diagnosis: rows, folds, the present model and its fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, groupby
from operator import is_
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.sparse import csr_matrix

from skidyn._cores import each
from skidyn._progress import tell
from skidyn._signals import Array, Signals
from skidyn.effects import Term, TermSum, get_effect
from skidyn.evidence._broken import without_broken
from skidyn.evidence._folds import RIDGE, Normal, nearest_folds
from skidyn.evidence._kinematics import smooth_motion
from skidyn.evidence._rows import (
    FEWEST_SAMPLES,
    WINDOW,
    Rows,
    RowsInTime,
    averaged,
    column_step,
    every_sample,
    interpolation,
    sliding_samples,
    window_rows,
)
from skidyn.robots import Robot, base_parameter_index, with_whole_turns

#: Columns of the rigid body weaker than this (relative, after pivoting) are dependent on others.
RANK_TOLERANCE = 2e-6
#: Folds are whole trajectories if there are more than this many, else blocks of them.
FEW_TRAJECTORIES, FEWEST_BLOCKS, MOST_FOLDS = 6, 8, 20
#: Combinations of columns smaller than the root of this, relative to their parts, may be
#: undetermined.
LARGEST_RIDGE = 1e-6
#: Samples per window that are enough for a smooth function; at first, others are omitted.
ENOUGH_SAMPLES = 16
#: Share of the smoother's half width that is left out around rest and reversals, and number of
#: samples left out where a model of hysteresis describes the motion between the two.
MARGIN, SHORT_MARGIN = 0.75, 1


@dataclass(frozen=True)
class Fit:
    """A weighted least-squares fit of the model with some terms.

    Attributes
    ----------
    terms : TermSum
        Terms beside the rigid body, in the order of the coefficients.
    coefficients : ndarray of shape (n_coefficients,)
        First the rigid body's independent parameters, then those of the terms.
    residual : list of ndarray of shape (n_rows_j,)
        Residual of the averaged rows of every joint, N m or N.
    sigma : ndarray of shape (n_joints,)
        Noise of one row of every joint, by which the rows were weighted.
    """

    terms: TermSum
    coefficients: Array
    residual: list[Array]
    sigma: Array

    @property
    def noise(self) -> Array:
        """Root mean square of the residual rows of every joint."""
        return np.array([np.sqrt(np.mean(r**2)) + 1e-100 if len(r) else 1.0 for r in self.residual])


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
    _cache: dict[Term, dict[int, Array]] = field(default_factory=dict, repr=False)
    #: Last results that are asked for again; shared by copies, since they state what they are of.
    _last: dict[str, tuple[list[Any], Any]] = field(default_factory=dict, repr=False)
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
        _, few = self.signals.once(("thinned", step), lambda: self.signals.thinned(step))
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
        groups = [list(g) for _, g in groupby(new, key=lambda t: (t.effect.needs, t.places))]
        found = each(lambda group: [of(term) for term in group], groups, text)
        rows = dict(zip(chain(*groups), chain(*found), strict=True))
        whole = (t for t in rows if not screening or self._skipped(t) <= self._step(t))
        self._cache |= {t: rows[t] for t in whole}
        return [rows[t] if t in rows else self._cache[t] for t in terms]

    def average(self, columns: dict[int, Array]) -> dict[int, Array]:
        """Averaged rows of columns given at every sample."""
        return {j: averaged(self.rows.weights[j], block) for j, block in columns.items()}

    def design(self, blocks: Sequence[dict[int, Array]]) -> list[Array]:
        """Rigid-body columns and blocks of columns side by side, per joint."""
        design = []
        for j in range(self.n_joints):
            n_rows = int(self.rows.counts[j])
            parts = [self.rigid_rows[j]]
            parts += [b[j] if j in b else np.zeros((n_rows, width(b))) for b in blocks]
            design.append(np.hstack(parts))
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
        return replace(self, rigid_index=base, rigid_rows=regressor_rows(self, base))

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
        fit = _weighted(terms, design, target, sigma)
        for k in range(1, passes):
            tell("Fitting", k / passes)
            fit = _weighted(terms, design, target, fit.noise)
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
        kept, found = self._last.get("alone", ([], ()))
        if len(kept) == len(made_of) and all(map(is_, kept, made_of)):
            before, fits = found
            if all(map(np.array_equal, before, target)):
                return list(fits)
        pairs = zip(self.design(blocks) if design is None else design, target, strict=True)
        fits = [FittedAlone.of(a, y) for a, y in pairs]
        self._last["alone"] = made_of, (target, fits)
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
        kept, found = self._last.get("explained", ([], ()))
        if len(kept) == len(made_of) and all(map(is_, kept, made_of)) and found[0] == fit.terms:
            return np.asarray(found[1])
        torque = self.term_torque(fit)
        if self.rigid_body:
            assert self.robot is not None
            change = self.correction(fit.coefficients)
            torque += self.robot.inverse_dynamics(s.q, s.dq, s.ddq, parameters=change)
        torque.flags.writeable = False  # it is returned again
        self._last["explained"] = made_of, (fit.terms, torque)
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


def hysteresis_joints(terms: Iterable[Term]) -> list[int]:
    """Joints, from 0, whose friction at reversals some of the terms describe."""
    joints = {j for t in terms if t.effect.family == "hysteresis" for j in t.places}
    return sorted(joints)


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
    rows, fold, n_folds, whole = _rows_and_folds(motion, reversals, weight)
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
    problem.logged = signals
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
    return _with_rows(problem, terms, _rows_and_folds(problem.signals, joints))


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
    return _with_rows(problem, terms, _rows_and_folds(problem.signals, (), window=window))


def _with_rows(problem: Problem, terms: Iterable[Term], rows_and_folds: _RowsAndFolds) -> Problem:
    rows, fold, n_folds, whole = rows_and_folds
    other = replace(
        problem,
        terms=TermSum(terms),
        rows=rows,
        fold=fold,
        n_folds=n_folds,
        whole_trajectories=whole,
        rigid_rows=[np.zeros((n, 0)) for n in rows.counts],
        rigid_index=np.zeros(0, dtype=np.int64),
        _cache={},
        _thinned={},
    )
    if other.rigid_body:
        _add_rigid_body(other)
    return other


def read_motion(signals: Signals, smooth: bool, torque: Array) -> Signals:
    """Motion as used by the rows, smoothed or as logged, without broken samples."""
    if signals.time is None:
        return signals
    motion = without_broken(smooth_motion(signals), signals, torque)
    return motion if smooth else motion.with_(q=signals.q, dq=signals.dq, ddq=signals.ddq)


def motion_rows(signals: Signals, reversals: Sequence[int], window: float = WINDOW) -> Rows:
    """Averaging windows over the samples that count."""
    if signals.time is None:
        return every_sample(signals)
    margin = np.full(signals.n_joints, max(1, round(MARGIN * signals.half_width)))
    margin[list(reversals)] = SHORT_MARGIN
    use = sliding_samples(signals, signals.usable, margin.tolist())
    step = column_step(signals, window, int(margin.min()))
    rows = window_rows(signals, use, window, step)
    few = rows.counts < FEWEST_ROWS
    if not (few & (rows.counts > 0)).any():
        return rows
    use = use & ~few  # a joint that slides for a moment only is treated as one at rest
    return window_rows(signals, use, window, step)


#: Rows of a joint at least: fewer are fitted by its own friction and inertia, whatever else acts.
FEWEST_ROWS = 12

_RowsAndFolds = tuple[Rows, list[NDArray[np.int64]], int, bool]


def _rows_and_folds(
    signals: Signals,
    reversals: Sequence[int],
    weight: Array | None = None,
    window: float = WINDOW,
) -> _RowsAndFolds:
    """Averaging windows and the folds they fall into."""
    # A slow log has wider windows, which extend further over a border; single samples do not.
    clock = signals.time is not None
    guard = max(WINDOW_GUARD, _half_window(signals.rate)) if clock else 0.0
    rows = motion_rows(signals, reversals, window)
    return _folds(rows if weight is None else rows.weighted(weight), guard)


def regressor_rows(problem: Problem, index: NDArray[np.int64] | None = None) -> list[Array]:
    """Averaged columns of the torque regressor, chunk by chunk; only the given ones if any."""
    assert problem.robot is not None
    robot = with_whole_turns(problem.robot)
    index = np.arange(10 * robot.n_bodies) if index is None else index
    rows = [np.zeros((count, len(index))) for count in problem.rows.counts]
    s, weights = problem.sampled(problem.rows.step)
    in_time = [RowsInTime.of(own) for own in weights]
    for chunk, regressor in robot.iter_torque_regressor(s.q, s.dq, s.ddq):
        for j, block in enumerate(rows):
            here, shares = in_time[j].within(chunk)
            block[here] += shares @ regressor[j][index].T
        tell("Computing the rigid body", chunk.stop / len(s.q))
    return rows


def _add_rigid_body(problem: Problem) -> None:
    """Average the torque regressor and keep its independent columns."""
    assert problem.robot is not None
    base = base_parameter_index(problem.robot)
    rows = regressor_rows(problem, base)
    shown = independent_columns(np.vstack(rows))
    problem.rigid_index = base[shown]
    problem.rigid_rows = (
        rows
        if len(shown) == len(base)
        else [np.ascontiguousarray(block[:, shown]) for block in rows]
    )


def independent_columns(rows: Array) -> NDArray[np.int64]:
    """Columns of base parameters that the data determines, by QR with pivoting; sorted.

    The triangular factor of the rows gives the same answer as the rows themselves.
    """
    size = np.linalg.norm(rows, axis=0)
    moved = np.flatnonzero(size > 1e-9 * max(size.max(initial=0.0), 1e-300))
    if not len(moved):
        return moved
    scaled = np.empty((len(rows), len(moved)), order="F")  # in the order of LAPACK: no copy
    for k, column in enumerate(moved):
        np.divide(rows[:, column], size[column], out=scaled[:, k])
    triangle, pivots = qr(scaled, overwrite_a=True, mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    rank = int(np.sum(diagonal > RANK_TOLERANCE * diagonal[0]))
    return np.sort(moved[pivots[:rank]])


def _half_window(rate: float) -> float:
    return FEWEST_SAMPLES / rate / 2


def _folds(rows: Rows, guard: float) -> tuple[Rows, list[NDArray[np.int64]], int, bool]:
    """Assign rows to folds and sort them; blocks of few trajectories lose the rows at borders."""
    names = np.unique(np.concatenate(rows.trajectory))
    whole = len(names) > FEW_TRAJECTORIES
    blocks = 1 if whole else max(2, -(-FEWEST_BLOCKS // max(1, len(names))))
    ends = {}
    for name in names:
        times = np.concatenate(
            [t[k == name] for t, k in zip(rows.time, rows.trajectory, strict=True)]
        )
        ends[name] = np.linspace(times.min(), times.max() + 1e-9, blocks + 1)
    n_folds = min(len(names) * blocks, MOST_FOLDS) if whole else len(names) * blocks
    fold, order = [], []
    for time, trajectory in zip(rows.time, rows.trajectory, strict=True):
        label = np.searchsorted(names, trajectory) * blocks
        keep = np.ones(len(time), dtype=bool)
        for name in names:
            inside = np.flatnonzero(trajectory == name)
            edges = ends[name][1:-1]
            label[inside] += np.searchsorted(edges, time[inside], side="right")
            for edge in edges:
                near = np.abs(time[inside] - edge) < guard
                keep[inside[near]] = False
        label = label * n_folds // (len(names) * blocks)
        index = np.flatnonzero(keep)
        index = index[np.argsort(label[index], kind="stable")]
        fold.append(label[index])
        order.append(index)
    return rows.taken(order), fold, n_folds, whole


#: Rows whose middle is nearer than this, or half a window, to the border between two blocks are
#: dropped, in s.
WINDOW_GUARD = 1 / 16


#: Directions weaker than this, relative to the strongest one, are due to rounding.
RANK = 1e-7


#: Rows for each direction of the columns of a joint from which its residual determines its noise.
ROWS_A_DIRECTION = 2.0


@dataclass(frozen=True)
class FittedAlone:
    """Residual of a joint fitted by itself, so that errors of other joints have no influence.

    Attributes
    ----------
    left, whole : float
        Squared residual and squared torque.
    rank : int
        Number of directions of the columns that the rows determine.
    """

    left: float
    whole: float
    rank: int

    @classmethod
    def of(cls, design: Array, target: Array) -> FittedAlone:
        """Fit rows, or their triangular factor."""
        if not len(target):
            return cls(0.0, 0.0, 0)
        size = np.linalg.norm(design, axis=0)
        used = size > 0
        scaled = design[:, used] / size[used]
        solution, _, rank, _ = np.linalg.lstsq(scaled, target, rcond=RANK)
        left, whole = np.sum((target - scaled @ solution) ** 2), np.sum(target**2)
        return cls(float(left), float(whole), int(rank))

    def noise(self, count: float, rows: float | None = None) -> float:
        """Root of the squared residual divided by ``count``.

        ``rows``, by default the same, is the number of rows that were fitted. With too few rows to
        determine the noise, the torque itself is its bound; without any, the noise is 1.
        """
        if not count:
            return 1.0
        rows = count if rows is None else rows
        left = self.left
        if rows <= ROWS_A_DIRECTION * self.rank:
            left = self.whole  # of a joint that hardly slides: a few rows are fitted by anything
        return float(np.sqrt(max(left, RANK**2 * self.whole) / count)) or 1.0


def own_noise(design: Array, target: Array, count: float, rows: float | None = None) -> float:
    """Noise of a joint fitted alone (:meth:`FittedAlone.noise`)."""
    return FittedAlone.of(design, target).noise(count, rows)


def weighted_least_squares(design: list[Array], target: list[Array], sigma: Array) -> Array:
    """Coefficients of least squares with joints weighted by their noise."""
    return _weighted(TermSum(), design, target, sigma).coefficients


def _weighted(terms: TermSum, design: list[Array], target: list[Array], sigma: Array) -> Fit:
    a = np.empty((sum(map(len, design)), design[0].shape[1]))
    ends = np.cumsum([0, *map(len, design)])
    for block, s, start, stop in zip(design, sigma, ends[:-1], ends[1:], strict=True):
        np.divide(block, s, out=a[start:stop])
    y = np.concatenate([t / s for t, s in zip(target, sigma, strict=True)])
    size = np.linalg.norm(a, axis=0)
    size[size == 0] = 1.0
    unit = a / size
    # No single column explains more than the whole torque. Undetermined quantities, such as the
    # share of a rotor in an inertia, are set by the smallest corrections, so that the loads of the
    # joints, which depend on them, stay realistic.
    ridge = max(RIDGE, 1 / max(float(y @ y), 1 / LARGEST_RIDGE))
    normal = Normal(unit.T @ unit, unit.T @ y, np.ones(len(size)), ridge)
    # One refinement step recovers the accuracy lost by forming the Gram matrix.
    scaled = normal.solution + normal.solve(unit.T @ (y - a @ (normal.solution / size)))
    coefficients = scaled / size
    residual = [t - block @ coefficients for block, t in zip(design, target, strict=True)]
    return Fit(terms, coefficients, residual, np.asarray(sigma, dtype=float))
