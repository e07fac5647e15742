# SPDX-License-Identifier: BSD-3-Clause
"""Evidence of a motion in memory, every sample a row, without storing the regressor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from skidyn._exceptions import SkidynError
from skidyn._signals import Array, Signals, blocks_held_out
from skidyn.effects import Term
from skidyn.evidence._evidence import Evidence, Key
from skidyn.evidence._motion_rows import MOST_FOLDS
from skidyn.evidence._rigid_rows import first_columns
from skidyn.evidence._streaming import linear_terms
from skidyn.robots import BaseParameters, Robot, find_base_parameters

Method = Literal["auto", "gram", "qr"]
#: Samples at a time: their columns stay in the third-level cache between making and using them.
CHUNK = 4096
#: Condition number of the scaled columns up to which Gram matrices keep about nine digits:
#: their error grows with its square, that of the QR factors with the number itself.
LARGEST_CONDITION = 1e3


def evidence_from_motion(
    robot: Robot,
    q: Any,
    dq: Any,
    ddq: Any,
    torque: Any,
    effects: Iterable[Any] = ("viscous", "coulomb"),
    *,
    trajectory: Any = None,
    method: Method = "auto",
) -> Evidence:
    """Evidence of positions, velocities, accelerations and torques, without filtering.

    The fastest way from arrays to parameters: nothing is filtered, every sample is a row of weight
    one, and the regressor is computed and used chunk by chunk.

    Parameters
    ----------
    robot : Robot
        Robot.
    q, dq, ddq : array-like of shape (n_samples, n_joints)
        Positions (rad, m), velocities and accelerations.
    torque : array-like of shape (n_samples, n_joints)
        Measured torque, N m or N.
    effects : iterable of str, (str, joints) or Term, default=("viscous", "coulomb")
        Effects beside the rigid body. Their shape parameters must be given.
    trajectory : array-like of shape (n_samples,) of int, optional
        Trajectory of every sample; one for all by default. Standard errors need several; number the
        blocks of a single long recording.
    method : {"auto", "gram", "qr"}, default="auto"
        ``"gram"`` forms Gram matrices, ``"qr"`` triangular factors chunk by chunk [1]_ in twice the
        time. ``"auto"`` takes the first unless the columns are so nearly dependent that digits
        would be lost (condition number above 1,000 with columns of unit size).

    Returns
    -------
    Evidence
        Evidence of the base parameters' corrections to the URDF, then of the effects.

    Raises
    ------
    SkidynError
        Arrays have inconsistent shapes or values that are not finite, or an effect needs a fit of
        the model first.

    See Also
    --------
    skidyn.evidence.evidence_from_parquet : Evidence from files, with parallel filtering.
    skidyn.identification.regressor_from_evidence : The fitted model.

    References
    ----------
    .. [1] J. Demmel, L. Grigori, M. Hoemmen, J. Langou, "Communication-optimal parallel and
       sequential QR and LU factorizations", SIAM J. Scientific Computing 34(1), 2012.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.evidence import evidence_from_motion
    >>> from skidyn.identification import regressor_from_evidence
    >>> robot = load_planar_arm()
    >>> q, dq, ddq = np.random.default_rng(0).uniform(-2, 2, (3, 1000, 2))
    >>> torque = robot.inverse_dynamics(q, dq, ddq) + 0.3 * dq
    >>> blocks = np.arange(1000) // 100
    >>> evidence = evidence_from_motion(robot, q, dq, ddq, torque, ("viscous",), trajectory=blocks)
    >>> regressor_from_evidence(robot, evidence, ("viscous",)).coef_[-2:].round(6)
    array([0.3, 0.3])
    """
    if method not in ("auto", "gram", "qr"):
        raise SkidynError(f"method is {method!r}; expected 'auto', 'gram' or 'qr'")
    signals, torque = _checked(robot, q, dq, ddq, torque, trajectory)
    terms = linear_terms(effects, robot.n_joints)
    return evidence_of_rows(signals, torque, robot, terms, signals.trajectory, method)


def evidence_of_rows(
    signals: Signals,
    torque: Array,
    robot: Robot,
    terms: Sequence[Term],
    group: NDArray[np.int64],
    method: Method = "auto",
    weight: Array | None = None,
) -> Evidence:
    """Evidence with every sample as a row.

    Parameters
    ----------
    signals : Signals
        Motion; states of hysteresis are computed along its trajectories.
    torque : ndarray of shape (n_samples, n_joints), N m or N
        Measured torque.
    robot : Robot
        Robot.
    terms : sequence of Term
        Effects with their shape parameters.
    group : ndarray of shape (n_samples,) of int
        Number of the factor to which a sample belongs, in place of its trajectory.
    method : {"auto", "gram", "qr"}, default="auto"
        Gram matrices or triangular factors.
    weight : ndarray of shape (n_samples,), optional
        Weight of every sample, 0 or more; a sample of weight 2 counts as two.

    Returns
    -------
    Evidence
        By group and joint.
    """
    base = find_base_parameters(robot)
    layout = _Layout.of(robot, base, terms, signals)
    factors: dict[Key, Array] = {}
    root = None if weight is None else np.sqrt(weight)
    if method != "qr":
        grams = _accumulate(robot, layout, signals, torque, group, _add_gram, root)
        if method == "gram" or _condition(grams, layout) <= LARGEST_CONDITION:
            factors = {key: _root(gram) for key, gram in grams.items()}
    if not factors:
        factors = _accumulate(robot, layout, signals, torque, group, _add_triangle, root)
    widened = {key: layout.widen(factor, key[1]) for key, factor in factors.items()}
    # The torque of the URDF's rigid body is a combination of the columns: it is subtracted here.
    nominal = np.zeros(len(layout.names) + 1)
    nominal[: len(base.index)] = -base.values(robot.inertial_parameters)
    nominal[-1] = 1.0
    for factor in widened.values():
        factor[:, -1] = factor @ nominal
    return Evidence(tuple(layout.names), widened, _counts(group, robot.n_joints, weight))


def sample_blocks(
    trajectory: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Blocks of samples: whole trajectories, or parts of them where there are few.

    Parameters
    ----------
    trajectory : ndarray of shape (n_samples,)
        Trajectory of every sample.

    Returns
    -------
    block : ndarray of shape (n_samples,) of int
        Block of every sample, from 0.
    owner : ndarray of shape (n_blocks,) of int
        Trajectory of every block.
    fold : ndarray of shape (n_blocks,) of int
        Fold of every block, from 0.
    """
    names, index, counts = np.unique(trajectory, return_inverse=True, return_counts=True)
    blocks = blocks_held_out(len(names))
    order = np.argsort(index, kind="stable")
    within = np.empty(len(index), dtype=np.int64)
    within[order] = np.arange(len(index)) - np.repeat(np.cumsum(counts) - counts, counts)
    block = index * blocks + within * blocks // counts[index]
    used, block = np.unique(block, return_inverse=True)
    fold = np.arange(len(used)) * min(len(used), MOST_FOLDS) // len(used)
    return block, names[used // blocks].astype(np.int64), fold


def renumbered(evidence: Evidence, number: NDArray[np.int64]) -> Evidence:
    """The same evidence with ``number[k]`` for k; factors with equal numbers are merged."""
    parts: dict[Key, list[Array]] = {}
    counts: dict[Key, float] = {}
    for (old, joint), factor in evidence.factors.items():
        key = int(number[old]), joint
        parts.setdefault(key, []).append(factor)
        counts[key] = counts.get(key, 0) + evidence.counts[old, joint]
    factors = {k: own[0] if len(own) == 1 else _qr(np.vstack(own)) for k, own in parts.items()}
    return Evidence(evidence.columns, factors, counts)


def _checked(
    robot: Robot, q: Any, dq: Any, ddq: Any, torque: Any, trajectory: Any
) -> tuple[Signals, Array]:
    """Signals in the order of their trajectories, and the torque in the same order."""
    arrays = {}
    for name, values in {"q": q, "dq": dq, "ddq": ddq, "torque": torque}.items():
        array = np.asarray(values, dtype=np.float64)
        if array.shape != (len(np.asarray(q)), robot.n_joints) or not len(array):
            raise SkidynError(
                f"{name} has shape {array.shape}; expected (n_samples, {robot.n_joints}) with the "
                "same number of samples in all, at least one"
            )
        # A sum is finite unless a term is not, or it overflows, which does not occur in
        # measurements.
        if not np.isfinite(array.sum()):
            row, joint = np.argwhere(~np.isfinite(array))[0]
            raise SkidynError(f"{name} of joint {joint + 1} is not finite in row {row}")
        arrays[name] = array
    number = np.zeros(len(arrays["q"]), dtype=np.int64)
    if trajectory is not None:
        given = np.asarray(trajectory)
        number = given.astype(np.int64)
        if number.shape != (len(arrays["q"]),) or not np.array_equal(number, given):
            raise SkidynError("trajectory must hold one whole number for every sample")
    if np.any(np.diff(number) < 0):
        order = np.argsort(number, kind="stable")
        number, arrays = number[order], {name: a[order] for name, a in arrays.items()}
    q, dq, ddq, torque = arrays.values()
    prismatic = np.array([kind == "prismatic" for kind in robot.joint_types])
    return Signals(q, dq, ddq, number, prismatic=prismatic, robot=robot), torque


def _counts(
    group: NDArray[np.int64], n_joints: int, weight: Array | None = None
) -> dict[Key, float]:
    names, place = np.unique(group, return_inverse=True)
    pairs = zip(names, np.bincount(place, weight).tolist(), strict=True)
    return {(int(name), j): count for name, count in pairs for j in range(n_joints)}


@dataclass
class _Layout:
    """Columns on which the torque of every joint depends, and their positions.

    Attributes
    ----------
    columns : tuple of int
        Independent columns of the torque regressor.
    names : list of str
        Of all columns, rigid body and effects.
    first : list of int
        Per joint, the first rigid-body column that does not vanish.
    effects : list of list of (int, ndarray of shape (n_samples,))
        Per joint, the effects' columns that act on it: their index among all and their values.
    """

    columns: tuple[int, ...]
    names: list[str]
    first: list[int]
    effects: list[list[tuple[int, Array]]] = field(repr=False)

    @classmethod
    def of(
        cls, robot: Robot, base: BaseParameters, terms: Sequence[Term], signals: Signals
    ) -> _Layout:
        names = [robot.parameter_names[i] for i in base.index]
        effects: list[list[tuple[int, Array]]] = [[] for _ in range(robot.n_joints)]
        for term in terms:
            for j, block in term.torque_columns(signals).items():
                effects[j] += [(len(names) + k, block[:, k]) for k in range(block.shape[1])]
            names += term.names
        columns = tuple(int(i) for i in base.index)
        return cls(columns, names, first_columns(robot, columns), effects)

    @property
    def spare(self) -> int:
        """Rows other than those of the rigid body: the effects of a joint, and its torque."""
        return max(len(own) for own in self.effects) + 1

    def place(self, joint: int) -> list[int]:
        """Indices of the columns of a joint, and of its torque, among all."""
        own = [number for number, _ in self.effects[joint]]
        return [*range(self.first[joint], len(self.columns)), *own, len(self.names)]

    def widen(self, factor: Array, joint: int) -> Array:
        """A triangular factor of all columns from one of the joint's."""
        size = len(self.names) + 1
        wide = np.zeros((size, size))
        place = self.place(joint)
        # The indices of the columns are ascending, so that the factor stays triangular.
        wide[np.ix_(place[: len(factor)], place)] = factor
        return wide


Update = Callable[[Array | None, Array], Array]


def _accumulate(
    robot: Robot,
    layout: _Layout,
    signals: Signals,
    torque: Array,
    group: NDArray[np.int64],
    update: Update,
    root: Array | None,
) -> dict[Key, Array]:
    """Apply ``update`` to the rows of every group and joint, part after part."""
    found: dict[Key, Array] = {}
    n_rigid = len(layout.columns)
    arrays = {"q": signals.q, "dq": signals.dq, "ddq": signals.ddq}
    chunks = robot._engine.iter_regressor_columns(arrays, layout.columns, layout.spare, CHUNK)
    for rows, block in chunks:
        parts = list(_parts(group[rows]))
        for j, (slab, first) in enumerate(zip(block, layout.first, strict=True)):
            own = layout.effects[j]
            for k, (_, values) in enumerate(own):
                slab[n_rigid + k] = values[rows]
            end = n_rigid + len(own) + 1
            slab[end - 1] = torque[rows, j]
            # Not in place: constant parts of the block are written only once.
            own_rows = slab[first:end] if root is None else slab[first:end] * root[rows]
            for name, part in parts:
                found[name, j] = update(found.get((name, j)), own_rows[:, part])
    return found


def _parts(group: NDArray[np.int64]) -> Iterator[tuple[int, slice]]:
    edges = np.r_[0, np.flatnonzero(np.diff(group)) + 1, len(group)].tolist()
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        yield int(group[start]), slice(start, stop)


def _add_gram(gram: Array | None, rows: Array) -> Array:
    product: Array = rows @ rows.T
    if gram is None:
        return product
    gram += product
    return gram


def _add_triangle(triangle: Array | None, rows: Array) -> Array:
    """Triangular factor of the rows seen before and these."""
    found = _qr(rows.T)
    return found if triangle is None else _qr(np.vstack([triangle, found]))


def _qr(rows: Array) -> Array:
    width = rows.shape[1]
    if len(rows) < width:
        rows = np.vstack([rows, np.zeros((width - len(rows), width))])
    packed, _, _, info = scipy.linalg.lapack.dgeqrf(rows)
    assert info == 0
    return np.triu(packed[:width])


def _root(gram: Array) -> Array:
    """Triangular factor of a Gram matrix, which may be singular."""
    size = np.sqrt(np.diag(gram))
    size[size == 0] = 1.0
    packed, pivots, rank, _ = scipy.linalg.lapack.dpstrf(gram / size[:, None] / size)
    factor = np.triu(packed)
    factor[rank:] = 0.0  # what dpstrf leaves there is not part of the factor
    ordered = np.empty_like(factor)
    ordered[:, pivots - 1] = factor
    return _qr(ordered) * size


def _condition(grams: dict[Key, Array], layout: _Layout) -> float:
    """Condition number of all columns of unit size, every joint weighted by its torque."""
    width = len(layout.names)
    total = np.zeros((width + 1, width + 1))
    for joint in range(len(layout.first)):
        own = np.sum([gram for key, gram in grams.items() if key[1] == joint], axis=0)
        if own[-1, -1] > 0:
            place = layout.place(joint)
            total[np.ix_(place, place)] += own / own[-1, -1]
    columns = total[:width, :width]
    size = np.sqrt(np.diag(columns))
    # A column of zeros is no combination of others; it has no information and does no harm.
    used = size > 0
    scaled = columns[np.ix_(used, used)] / size[used, None] / size[used]
    values = np.linalg.eigvalsh(scaled) if used.any() else np.ones(1)
    return float(np.sqrt(values[-1] / max(values[0], 1e-300)))
