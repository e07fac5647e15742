# SPDX-License-Identifier: BSD-3-Clause
"""Terms (effects on certain joints with their shapes) and sums of terms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._exceptions import EffectError
from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient
from skidyn.effects._registry import get_effect

#: Number of joints of the motion on which terms are tried; larger than that of any robot here.
_JOINTS = 32
#: Entries of a shape that any effect may have; others belong to the effect.
_WHEN = ("trajectories", "spans", "course")


@dataclass(frozen=True)
class Term:
    """An effect on certain joints with certain shape parameters: one block of regressor columns.

    Terms can be added: ``Term("viscous", (1,)) + Term("coulomb", (1,))`` is a :class:`TermSum`, a
    part of a model.

    Parameters
    ----------
    kind : str
        Kind of the effect, a name of the catalogue.
    joints : tuple of int
        Joints, counted from 1; all joints for an effect of the whole robot.
    shape : mapping of str to object
        Values of the shape parameters; empty if the effect has none.

    Examples
    --------
    >>> term = Term("dahl", (1,), {"presliding": 0.02})
    >>> print(term)
    dahl(joint 1, presliding=0.02)
    >>> term.names, term.effect.title
    (('dahl.F[1]',), 'Dahl friction (pre-sliding)')
    """

    kind: str
    joints: tuple[int, ...]
    shape: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if any(joint < 1 for joint in self.joints):
            raise EffectError(f"{self.kind}: joints={self.joints}; joints are counted from 1")

    @classmethod
    def at(cls, kind: str, places: Iterable[int], shape: Mapping[str, Any] | None = None) -> Term:
        """Term of the joints at these places in arrays, which Python counts from 0.

        Parameters
        ----------
        kind : str
            Kind of the effect.
        places : iterable of int
            Columns of the joints in arrays of all joints.
        shape : mapping of str to object, optional
            Values of the shape parameters.

        Returns
        -------
        Term
        """
        return cls(kind, tuple(place + 1 for place in places), {} if shape is None else shape)

    @property
    def places(self) -> tuple[int, ...]:
        """Columns of the joints in arrays of all joints, which Python counts from 0."""
        return tuple(joint - 1 for joint in self.joints)

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        shape = self.shape.items()
        try:
            return hash((self.kind, self.joints, frozenset(shape)))
        except TypeError:  # a value that is a list
            return hash((self.kind, self.joints, frozenset(map(str, shape))))

    def __getstate__(self) -> dict[str, Any]:
        # another process has other hashes
        return {"kind": self.kind, "joints": self.joints, "shape": self.shape}

    def __str__(self) -> str:
        shape = "".join(f", {k}={_short(v)}" for k, v in self.shape.items())
        return f"{self.kind}(joint {self._numbers(', ')}{shape})"

    def __add__(self, other: Term | Iterable[Term]) -> TermSum:
        return TermSum((self,)) + other

    def _numbers(self, between: str) -> str:
        return between.join(map(str, self.joints))

    @property
    def trajectories(self) -> tuple[int, ...] | None:
        """Trajectories in which the effect acts; None for all.

        Any effect may act in some recordings only, such as a carried load, a sensor with a new
        zero, or increased friction. ``trajectories`` in the shape lists them.
        """
        return self.shape.get("trajectories")

    @property
    def spans(self) -> tuple[tuple[int, float, float], ...]:
        """Trajectories in which the effect acts for some time only, with its start and end in s.

        ``spans`` in the shape lists them, in addition to ``trajectories``.
        """
        spans: tuple[tuple[int, float, float], ...] = self.shape.get("spans", ())
        return spans

    @property
    def course(self) -> tuple[tuple[int, float, float, float, float], ...]:
        """Sizes of an effect that changes steadily: trajectory, two times in s, the size at each.

        Sizes are shares of the coefficients; before the first time of a trajectory and after the
        second one they stay as they are there. ``course`` in the shape lists them; the effect does
        not act in trajectories without an entry.
        """
        course: tuple[tuple[int, float, float, float, float], ...] = self.shape.get("course", ())
        return course

    @property
    def when(self) -> dict[str, Any]:
        """Entries of the shape that limit when the effect acts, or with which size."""
        return {k: v for k, v in self.shape.items() if k in _WHEN}

    @property
    def form(self) -> dict[str, Any]:
        """Entries of the shape that only a further form of the formula has, as Python numbers."""
        own = {k: v for k, v in self.shape.items() if k in self.effect.form_names}
        return {k: v.item() if isinstance(v, np.generic) else v for k, v in own.items()}

    @property
    def _own_shape(self) -> dict[str, Any]:
        return {k: v for k, v in self.shape.items() if k not in _WHEN}

    @property
    def everywhere(self) -> Term:
        """The same term in all trajectories."""
        return Term(self.kind, self.joints, self._own_shape)

    @property
    def is_further_form(self) -> bool:
        """Whether the formula differs from the plain one of its kind."""
        return not self.effect.form_names.isdisjoint(self.shape)

    @property
    def effect(self) -> Effect:
        """The effect of this kind in the catalogue."""
        return get_effect(self.kind)

    @property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """Linear coefficients, one per column."""
        return self.effect.coefficients_of(self.shape)

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.coefficients)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, such as ``"viscous.Fv[1]"``, joints counted from 1."""
        chosen = "" if self.trajectories is None else f"@{','.join(map(str, self.trajectories))}"
        chosen += "@course" if self.course else ""
        place = f"[{self._numbers(',')}]{chosen}"
        return tuple(f"{self.kind}.{c.name}{place}" for c in self.coefficients)

    @property
    def signs(self) -> Array:
        """1 for every coefficient that cannot be negative physically, else 0; (width,)."""
        return np.array([c.sign for c in self.coefficients], dtype=float)

    @property
    def lowest(self) -> Array:
        """Smallest physically admissible value of every coefficient for its shape, (width,)."""
        return np.where(self.signs > 0, self.effect.least(self.shape), -np.inf)

    @property
    def zeros(self) -> NDArray[np.bool_]:
        """Coefficients that only define the zero of the effect, (width,)."""
        return np.array([c.is_zero for c in self.coefficients], dtype=bool)

    @property
    def limits(self) -> Array:
        """Largest magnitude of every coefficient for which the formula is valid, (width,)."""
        return np.array([c.limit for c in self.coefficients])

    @property
    def is_open(self) -> bool:
        """Whether the effect has shape parameters that this term does not specify."""
        return self.effect.has_shape and not self._own_shape

    @property
    def is_dry(self) -> bool:
        """Whether the torque is discontinuous at reversals, as for dry friction.

        Determined from the columns: their difference between both directions at a hundredth of unit
        velocity is still a large part of that at unit velocity.
        """
        return _is_dry(self.effect, self)

    @property
    def is_pointwise(self) -> bool:
        """Whether the columns at a sample depend on that sample only.

        Determined from the columns along a motion and at every second sample of it. False if the
        effect cannot be evaluated without the robot.
        """
        return _is_pointwise(self.effect, self)

    @property
    def follows_position(self) -> bool:
        """Whether it is a force that depends on the joint position, as for springs and stops."""
        effect = self.effect
        own = effect.scope == "joint" and effect.drawn_against == "q" and effect.search == "grid"
        return own and not effect.nameless and not self.is_dry

    def with_shape(self, **values: Any) -> Term:
        """The same effect on the same joints with some shape parameters changed or added.

        Parameters
        ----------
        **values : object
            Shape parameters by name.

        Returns
        -------
        Term
            A new term.
        """
        return Term(self.kind, self.joints, {**self.shape, **values})

    def torque_columns(self, signals: Signals) -> dict[int, Array]:
        """Columns at every sample, in the torque row of every joint that the effect reaches.

        Parameters
        ----------
        signals : Signals
            Motion, with the torque of the model if the effect needs it.

        Returns
        -------
        dict of int to ndarray of shape (n_samples, width)
            By the joint's place in arrays.
        """
        columns = self.effect.torque_columns(signals, self.places, **self._own_shape)
        if self.trajectories is None and not self.course:
            return columns
        size = self.size(signals)[:, None]
        return {j: np.where(size != 0, size * block, 0.0) for j, block in columns.items()}

    def size(self, signals: Signals) -> Array:
        """Share of the coefficients with which the effect acts at every sample.

        Parameters
        ----------
        signals : Signals
            Motion.

        Returns
        -------
        ndarray of shape (n_samples,)
            One everywhere unless the shape has ``trajectories``, ``spans`` or ``course``.
        """
        name, time = signals.trajectory, signals.clock
        size = np.ones(len(time))
        if self.trajectories is not None:
            size[~np.isin(name, self.trajectories)] = 0.0
        for own, start, end in self.spans:
            size[(name == own) & ((time < start) | (time > end))] = 0.0
        if self.course:
            size[~np.isin(name, [own for own, *_ in self.course])] = 0.0
        for own, start, first, end, last in self.course:
            here = name == own
            size[here] *= np.interp(time[here], [start, end], [first, last])
        return size

    def parameters(self, coefficients: Array, signals: Signals | None = None) -> dict[str, Any]:
        """Physical parameters from fitted coefficients.

        Parameters
        ----------
        coefficients : ndarray of shape (width,)
            Fitted values.
        signals : Signals, optional
            Motion the term was fitted on.

        Returns
        -------
        dict of str to float
            By name.
        """
        return self.effect.parameters(coefficients, self._own_shape, signals)


class TermSum(tuple[Term, ...]):
    """Ordered sum of terms: a part of a model, with one block of coefficients.

    Parameters
    ----------
    iterable : iterable of Term, default=()
        The terms.

    Examples
    --------
    >>> from skidyn.effects import Term
    >>> friction = Term("viscous", (1,)) + Term("coulomb", (1,))
    >>> friction.names
    ('viscous.Fv[1]', 'coulomb.Fc[1]')
    >>> [(term.kind, own) for term, own in friction.slices()]
    [('viscous', slice(0, 1, None)), ('coulomb', slice(1, 2, None))]
    """

    __slots__ = ()

    def __add__(self, other: Term | Iterable[Term]) -> TermSum:  # type: ignore[override]
        return TermSum((*self, *((other,) if isinstance(other, Term) else other)))

    @property
    def width(self) -> int:
        """Number of columns."""
        return sum(term.width for term in self)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        return tuple(name for term in self for name in term.names)

    @property
    def signs(self) -> Array:
        """1 for every coefficient that cannot be negative physically, else 0; (width,)."""
        return np.concatenate([np.zeros(0), *(term.signs for term in self)])

    def slices(self, start: int = 0) -> Iterator[tuple[Term, slice]]:
        """Every term with the slice of its coefficients.

        Parameters
        ----------
        start : int, default=0
            Index of the first coefficient of the first term, for example after those of the rigid
            body.

        Yields
        ------
        (Term, slice)
        """
        for term in self:
            yield term, slice(start, start + term.width)
            start += term.width


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _trial(term: Term, dq: Array, trajectory: NDArray[np.int64]) -> Signals:
    """Motion on which a term is tried without robot and time; all other signals are random."""
    rng = np.random.default_rng(0)
    shape = (len(dq), max(_JOINTS, *term.joints))
    q, ddq, load, torque, temperature = rng.normal(size=(5, *shape))
    return Signals(
        q=q,
        dq=dq[:, None] * np.arange(1.0, 1.0 + shape[1]),
        ddq=ddq,
        trajectory=trajectory,
        temperature=30.0 + 10.0 * temperature,
        load=load,
        model_torque=torque,
        smooth_torque=torque,
    )


def _columns(term: Term, signals: Signals) -> Array | None:
    """Columns of a trial, None if the effect cannot be evaluated on it."""
    try:
        return np.concatenate(list(term.torque_columns(signals).values()), axis=1)
    except Exception:  # an effect of a user may raise any exception if the robot is missing
        return None


@lru_cache(maxsize=512)
def _is_dry(effect: Effect, term: Term) -> bool:
    # Every sample is a separate trajectory, so no state depends on the sample before. The other
    # signals have to be the same in both directions.
    speeds = np.array([-1.0, -0.01, 0.01, 1.0])
    signals = _trial(term, speeds, np.arange(4))
    same = {
        name: np.repeat(getattr(signals, name)[:1], 4, axis=0)
        for name in ("q", "ddq", "load", "model_torque", "smooth_torque", "temperature")
    }
    columns = _columns(term, signals.with_(**same, time=np.full(4, 0.5)))
    if columns is None:
        return False
    slow, fast = np.abs(columns[2] - columns[1]), np.abs(columns[3] - columns[0])
    return bool(np.any(slow > 0.3 * fast + 1e-12))


@lru_cache(maxsize=512)
def _is_pointwise(effect: Effect, term: Term) -> bool:
    rows = np.arange(40)
    signals = _trial(term, np.cos(0.7 * rows), 0 * rows)
    whole, part = _columns(term, signals), _columns(term, signals.take(rows[::2]))
    return whole is not None and part is not None and np.array_equal(whole[::2], part)
