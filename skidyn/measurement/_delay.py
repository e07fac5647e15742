# SPDX-License-Identifier: BSD-3-Clause
"""Delay of the torque relative to the motion, from identified bodies, friction and rotors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.measurement._fits import Fits, lines_between
from skidyn.measurement._joint_fit import own_columns, sliding
from skidyn.measurement._loads import LOAD, by_recording
from skidyn.measurement._peak import vertex
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import FEWEST

#: Lags that are tried, s, and those if the best is beyond them; number of groups of rows that are
#: left out in turn.
LAGS, FAR_LAGS = np.linspace(-0.06, 0.06, 13), np.linspace(-0.24, 0.24, 25)
GROUPS = 8
#: Share of the joints whose best lag is beyond those tried from which later ones are tried.
MOST_BEYOND = 0.5
#: Fewest rows of a recording for its own lag.
FEWEST_OF_RUN = 15
#: Largest difference of agreeing lags of joints in one recording, s.
NEARLY = 0.008
#: Log-likelihood from which a joint has a word in the lag of a recording.
AGREED = 2.0
#: Rows that are worth one, since noise is correlated.
CORRELATED = 2.0
#: Largest share of the torque's spread that the fit of a joint may leave for its lag to count.
LEFT = 0.5


@dataclass(frozen=True)
class RunDelay:
    """Lag of the torque in one recording.

    Attributes
    ----------
    lag, error : float, s
        Lag and its standard error, from joint to joint.
    gain : float
        Its log-likelihood gain over the lag of the other recordings.
    agreeing : float
        Share of the gain on joints whose own lag is close to it.
    left : float
        Root mean square residual with it, relative to the noise of the other recordings.
    before : float
        The same at the lag of the other recordings.
    usual : float, s
        Lag of the other recordings.
    joints : int
        Number of joints whose own lag is close to it, with a word in it.
    """

    lag: float
    error: float
    gain: float
    agreeing: float
    left: float = 1.0
    before: float = 1.0
    usual: float = 0.0
    joints: int = 0


@dataclass(frozen=True)
class Delay:
    """Lag of the torque behind the motion.

    Attributes
    ----------
    common : float, s
        Lag of all joints together; positive if torque is late, NaN if it cannot be determined.
    error : float, s
        Its standard error.
    joints, errors : ndarray of shape (n_joints,), s
        Lag of every joint alone and its standard error, NaN if it cannot be determined.
    gain : float
        Log-likelihood gained by the common lag.
    gains : ndarray of shape (n_joints,)
        Log-likelihood that every joint gains by its own lag.
    halves : ndarray of shape (n_joints, 2), s
        Lag in the slower and in the faster rows of every joint: a delay is the same in both, unlike
        friction at reversals.
    early, late : float, s
        Common lag in the first and in the second half of the recordings; clocks with different
        rates drift apart.
    drift_error : float, s
        Standard error of their difference.
    runs : dict of int to RunDelay
        Result of every recording.
    drifts : ndarray of shape (n_joints,), s
        Lag of every joint in the second half of the recordings minus that in the first.
    """

    common: float
    error: float
    joints: Array
    errors: Array
    gain: float
    gains: Array
    halves: Array
    early: float = np.nan
    late: float = np.nan
    drift_error: float = np.nan
    runs: Mapping[int, RunDelay] = field(default_factory=dict)
    drifts: Array = field(default_factory=lambda: np.zeros(0))


def find_delay(fits: Fits) -> Delay:
    """Lag at which bodies, friction and rotor inertia explain the torque best.

    Parameters
    ----------
    fits : Fits
        Rows.
    """
    near, beyond, late_runs = _delay_within(fits, LAGS)
    if not beyond and not late_runs:
        return near
    far, *_ = _delay_within(fits, FAR_LAGS)
    # a single joint, with few rows, may have any lag
    later = {run: one for run, one in far.runs.items() if late_runs and one.joints > 1}
    runs = {**later, **near.runs}
    if not beyond:  # only single recordings are
        return replace(near, runs=runs)
    if beyond > MOST_BEYOND * fits.n_joints:
        return replace(far, runs={})  # these lags are too far apart for single recordings
    only_far = ~np.isfinite(near.joints) & np.isfinite(far.joints)
    return replace(
        near,
        joints=np.where(only_far, far.joints, near.joints),
        errors=np.where(only_far, far.errors, near.errors),
        gains=np.where(only_far, far.gains, near.gains),
        halves=np.where(only_far[:, None], far.halves, near.halves),
        drifts=np.where(only_far, far.drifts, near.drifts),
        runs=runs,
    )


@dataclass(frozen=True)
class Rest:
    """What bodies, friction and rotor inertia leave of the torque of a joint, at every lag.

    Attributes
    ----------
    joint : int
        Joint, from 0.
    rows : ndarray of shape (n_rows,) of bool
        Rows that are used, of all.
    torque, rest : ndarray of shape (n_used_rows, n_lags)
        Torque, and its rest.
    shared : ndarray of shape (n_used_rows, n_columns)
        Orthonormal columns that all recordings have in common.
    squares : ndarray of shape (GROUPS, n_lags)
        Squares of the rest in every group of rows.
    speed : ndarray of shape (n_used_rows,), rad/s or m/s
        Size of the velocity.
    """

    joint: int
    rows: NDArray[np.bool_]
    torque: Array
    rest: Array
    shared: Array
    squares: Array
    speed: Array


def _delay_within(fits: Fits, lags_tried: Array) -> tuple[Delay, int, int]:
    """The best of some lags, and how many joints and recordings have the first or the last."""
    n, beyond, middle = fits.n_joints, 0, len(lags_tried) // 2
    lags, own_errors, drifts = (np.full(n, np.nan) for _ in range(3))
    own_gains, halves = np.zeros(n), np.full((n, 2), np.nan)
    # of every joint: number of rows, and squares of all of them and of those in first halves
    tables: list[tuple[int, Array, Array]] = []
    costs: dict[int, list[Array]] = {}
    counts: dict[int, int] = {}
    first = _first_half(fits)
    for one in _rests(fits, lags_tried):
        j, total = one.joint, one.squares.sum(axis=0)
        if int(np.argmin(total)) in (0, len(lags_tried) - 1):
            beyond += 1
            continue
        run_of = fits.recording[one.rows]
        for run, cost in _run_costs(one.shared, one.torque, run_of):
            costs.setdefault(run, []).append(cost)
            counts[run] = counts.get(run, 0) + int(np.sum(run_of == run))
        halved = _squares(one.rest * first[one.rows][:, None])
        tables.append((len(one.rest), one.squares, halved))
        sooner = halved.sum(axis=0)
        lags[j] = _lowest(total, lags_tried)
        drifts[j] = _lowest(total - sooner, lags_tried) - _lowest(sooner, lags_tried)
        own_errors[j] = _spread([_lowest(total - group, lags_tried) for group in one.squares])
        fast = one.speed > np.median(one.speed)
        halves[j] = [
            _lowest((one.rest[rows] ** 2).sum(axis=0), lags_tried) for rows in (~fast, fast)
        ]
        own_gains[j] = len(one.rest) / 2 * np.log(total[middle] / _least(total))
    found = Delay(np.nan, np.nan, lags, own_errors, 0.0, own_gains, halves, drifts=drifts)
    if not tables:
        return found, beyond, 0
    runs, runs_beyond = _of_runs(costs, counts, lags_tried)
    return replace(_in_common(found, tables, lags_tried), runs=runs), beyond, runs_beyond


def _rests(fits: Fits, lags_tried: Array) -> Iterator[Rest]:
    """What is left of the torque of every joint that bodies explain at some lag."""
    s = Reading().motion(fits.signals)
    every = np.arange(10 * fits.robot.n_bodies)
    regressor = fits.mean_regressor(fits.robot, s, every)
    shifted = [fits.average(fits.torque_at(lag)) for lag in lags_tried]
    middle = len(lags_tried) // 2
    for j in range(fits.n_joints):
        use = sliding(fits, s, j)
        if not fits.usable(j) or use.sum() < FEWEST:
            continue
        felt = regressor[use, j]
        plain = np.column_stack([felt, fits.average(own_columns(s, j))[use]])
        further = fits.average(lines_between(s.q[:, j]))[use]
        y = np.stack([torque[use, j] for torque in shifted], axis=1)
        shared = basis = _basis(plain)
        loads = by_recording(felt[:, LOAD], fits.recording[use])
        wider = _basis(np.column_stack([plain, further, loads]))
        if _needed(basis, wider, y):
            # a load of a recording would follow part of its own lag
            shared, basis = _basis(np.column_stack([plain, further])), wider
        if basis.shape[1] > 0.5 * len(basis):
            continue
        rest = y - basis @ (basis.T @ y)
        spread = float(np.sum((y[:, middle] - y[:, middle].mean()) ** 2))
        squares = _squares(rest)
        if spread <= 0 or squares.sum(axis=0).min() > LEFT * spread:
            continue
        speed = np.abs(fits.average(s.dq[:, j])[use])
        yield Rest(j, use, y, rest, shared, squares, speed)


def _squares(rest: Array) -> Array:
    """Sum of squares in every group of rows."""
    return np.stack([(part**2).sum(axis=0) for part in np.array_split(rest, GROUPS)])


def _in_common(
    found: Delay, tables: Sequence[tuple[int, Array, Array]], lags_tried: Array
) -> Delay:
    """Lags of single joints with that of all of them, and with those of halves of recordings."""
    # squared errors, and not their logarithms, are a parabola of the lag
    noise = [float(squares.sum(axis=0).min()) / n for n, squares, _ in tables]

    def lag(parts: Sequence[Array], left_out: int | None = None) -> float:
        keep = [g for g in range(GROUPS) if g != left_out]
        cost = [e[keep].sum(axis=0) / (2 * s) for s, e in zip(noise, parts, strict=True)]
        return _lowest(np.asarray(np.sum(cost, axis=0)), lags_tried)

    whole = [squares for _, squares, _ in tables]
    firsts = [sooner for *_, sooner in tables]
    seconds = [squares - sooner for _, squares, sooner in tables]
    likely = sum(n / 2 * np.log(squares.sum(axis=0)) for n, squares, _ in tables)
    return replace(
        found,
        common=lag(whole),
        error=_spread([lag(whole, g) for g in range(GROUPS)]),
        gain=float(likely[len(lags_tried) // 2] - _least(likely)),
        early=lag(firsts),
        late=lag(seconds),
        drift_error=_spread([lag(seconds, g) - lag(firsts, g) for g in range(GROUPS)]),
    )


def _run_costs(
    basis: Array, torque: Array, run_of: NDArray[np.int64]
) -> Iterator[tuple[int, Array]]:
    """Half the squared residual of every recording over noise, by lag, with the bodies of others.

    These are fitted at the lag at which they explain the other recordings best.

    Parameters
    ----------
    basis : ndarray of shape (n_rows, n_columns)
        Orthonormal columns.
    torque : ndarray of shape (n_rows, n_lags)
        Torque at every lag.
    run_of : ndarray of shape (n_rows,)
        Recording of every row.
    """
    whole = basis.T @ torque
    for run in np.unique(run_of).tolist():
        rows = run_of == run
        own = basis[rows]
        if rows.sum() < FEWEST_OF_RUN or rows.all():
            continue
        gram = np.eye(basis.shape[1]) - own.T @ own
        gram[np.diag_indices(len(gram))] += 1e-3  # excited only by this recording
        found = np.linalg.solve(gram, whole - own.T @ torque[rows])
        others = np.mean((torque[~rows] - basis[~rows] @ found) ** 2, axis=0)
        usual = int(np.argmin(others))
        bodies, noise = found[:, usual], float(others[usual])
        if noise <= 0:
            continue
        left = torque[rows] - (own @ bodies)[:, None]
        # unknown parameters of the others' bodies have no penalty
        known = (left**2).sum(axis=0) - ((own.T @ left) ** 2).sum(axis=0)
        yield run, known / (2 * noise)


def _of_runs(
    squares: Mapping[int, list[Array]], counts: Mapping[int, int], tried: Array
) -> tuple[dict[int, RunDelay], int]:
    """Lags of single recordings, from half the squared residuals of their joints over noise.

    Also returns the number of recordings whose best lag is the first or the last.
    """
    if len(squares) < 3:
        return {}, 0
    whole = {run: np.sum(parts, axis=0) for run, parts in squares.items()}
    found, beyond = {}, 0
    for run, parts in squares.items():
        usual = _lowest(
            np.sum([cost for other, cost in whole.items() if other != run], axis=0), tried
        )
        lag = _lowest(whole[run], tried)
        here, there = (int(np.argmin(np.abs(tried - x))) for x in (usual, lag))
        if there in (0, len(tried) - 1):
            beyond += 1
            continue
        gains = np.array([part[here] - part[there] for part in parts])
        own = np.array([_lowest(part, tried) for part in parts])
        weight = np.maximum(gains, 0)
        near = np.abs(own - lag) < max(NEARLY, 0.3 * abs(lag))
        total = max(float(weight.sum()), 1e-12)
        error = float(np.sqrt(weight @ (own - lag) ** 2 / total / max(len(own), 1)))
        agreeing = float(weight[near].sum()) / total
        left, before = (np.sqrt(2 * float(whole[run][x]) / counts[run]) for x in (there, here))
        found[run] = RunDelay(
            lag - usual,
            error,
            float(gains.sum()),
            agreeing,
            float(left),
            float(before),
            usual,
            joints=int(np.sum(near & (gains > AGREED))),
        )
    return found, beyond


def _first_half(fits: Fits) -> NDArray[np.bool_]:
    """Rows in the first half of their recording."""
    time, number = fits.average(fits.signals.clock), fits.recording
    first = np.zeros(fits.n_rows, dtype=bool)
    for run in np.unique(number):
        rows = number == run
        first[rows] = time[rows] < (time[rows].min() + time[rows].max()) / 2
    return first


def _spread(values: list[float]) -> float:
    """Standard error from estimates that leave out one group of rows each."""
    return float(np.sqrt((GROUPS - 1) * np.var(values)))


def _basis(columns: Array) -> Array:
    """Orthonormal columns that span the same."""
    columns = columns[:, np.abs(columns).max(axis=0) > 0]
    basis, values, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    return np.asarray(basis[:, values > 1e-6 * values[0]])


def _needed(known: Array, wider: Array, torque: Array) -> bool:
    """Whether further columns explain more than chance, by the Bayesian information criterion.

    If nothing is missing, they would only follow part of the lag.
    """
    n, further = len(known), wider.shape[1] - known.shape[1]
    if wider.shape[1] > 0.5 * n:
        return False
    left, least = (
        float(np.min(np.sum((torque - basis @ (basis.T @ torque)) ** 2, axis=0)))
        for basis in (known, wider)
    )
    return left > 0 and bool(
        n * np.log(left / max(least, 1e-300)) > CORRELATED * further * np.log(n)
    )


def _lowest(cost: Array, lags: Array) -> float:
    """Lag of least cost, interpolated by a parabola."""
    k = int(np.argmin(cost))
    return float(lags[k] + float(lags[1] - lags[0]) * _bottom(cost, k))


def _least(cost: Array) -> float:
    """Least cost, interpolated between the lags that were tried."""
    k = int(np.argmin(cost))
    step = _bottom(cost, k)
    return float(cost[k] - 0.25 * step * (cost[k - 1] - cost[k + 1]) if step else cost[k])


def _bottom(cost: Array, k: int) -> float:
    """Minimum of a parabola through a cost and its neighbours, in units of their distance."""
    if k in (0, len(cost) - 1):
        return 0.0
    return vertex(*-cost[k - 1 : k + 2]) or 0.0
