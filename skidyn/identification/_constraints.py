# SPDX-License-Identifier: BSD-3-Clause
"""Prior knowledge of bodies: masses, centres of mass, symmetry, total mass."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import qr

from skidyn._signals import Array
from skidyn.identification._log_det import (
    Linear,
    existing_bodies,
    from_pseudo_inertia,
    pseudo_inertia,
)

#: Positions of parameters that are odd under a mirror at x = 0, y = 0, z = 0.
_ODD = {"x": (1, 5, 6), "y": (2, 5, 8), "z": (3, 6, 8)}
#: Share of a range by which the start is inside its limits.
INSIDE = 0.05


@dataclass(frozen=True)
class BodyConstraints:
    """Constraints on bodies for a consistent identification.

    Parameters
    ----------
    mass : mapping of str to (float, float)
        Lowest and highest mass of a body in kg; equal for a known mass.
    centre_of_mass : mapping of str to (sequence of 3 floats, sequence of 3 floats)
        Lowest and highest coordinates of the centre of mass in the frame of the body, m.
    symmetry : mapping of str to str
        Mirror planes through the origin of the body's frame, given by their normal axes: ``"y"``
        for a body that is symmetric about y = 0, ``"xy"`` for two planes.
    total_mass : float, optional
        Mass of all moving bodies together, kg.

    See Also
    --------
    RBDRegressor : Takes the constraints as ``consistent``.

    Notes
    -----
    A body is a link with all links fixed to it; the names are those of ``Robot.body_names``. Fixed
    or locked links at the base do not move and cannot be constrained.

    References
    ----------
    P. Wensing, S. Kim, J.-J. Slotine (2018), Linear matrix inequalities for physically consistent
    inertial parameter identification, IEEE RA-L 3(1), 60-67.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import BodyConstraints, RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0)
    >>> known = BodyConstraints(mass={"link2": (0.9, 1.1)}, total_mass=3.1)
    >>> model = RBDRegressor(log.robot, consistent=known).fit(log.X, log.y)
    >>> mass = model.inertial_parameters_[:, 0]
    >>> bool(0.9 < mass[1] < 1.1), round(float(mass.sum()), 6)
    (True, 3.1)
    """

    mass: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    centre_of_mass: Mapping[str, tuple[Sequence[float], Sequence[float]]] = field(
        default_factory=dict
    )
    symmetry: Mapping[str, str] = field(default_factory=dict)
    total_mass: float | None = None


def body_constraints(known: BodyConstraints, names: Sequence[str], signs: Array) -> Linear:
    """Constraints as inequalities and equations of parameters and coefficients.

    ``signs`` are 1 for coefficients that must not be negative. A ValueError is raised if a body is
    unknown or limits are contradictory.
    """
    n = 10 * len(names)
    width = n + len(signs)
    limits: list[tuple[Array, float]] = []
    equations: list[tuple[Array, float]] = []
    for row, low, high in _ranges(known, names, width):
        if low == high:
            equations.append((row, low))
            continue
        limits += [(s * row, s * v) for s, v in ((1, high), (-1, low)) if np.isfinite(v)]
    for row, low, high in _centres(known, names, width):
        mass = np.zeros(width)
        mass[10 * (int(np.argmax(row)) // 10)] = 1.0
        if low == high:
            equations.append((row - low * mass, 0.0))
            continue
        limits += [(s * (row - v * mass), 0.0) for s, v in ((1, high), (-1, low)) if np.isfinite(v)]
    for name, axes in known.symmetry.items():
        for k in sorted({k for axis in axes for k in _odd(name, axis)}):
            equations.append((_unit(10 * _body(name, names) + k, width), 0.0))
    limits += [(-_unit(n + int(k), width), 0.0) for k in np.flatnonzero(signs > 0)]
    rows, values = _stacked(limits, width)
    return Linear(rows, values, *_independent(*_stacked(equations, width)))


def start_bodies(known: BodyConstraints, names: Sequence[str], nominal: Array) -> Array:
    """Bodies near the nominal ones that satisfy all constraints strictly.

    A ValueError is raised if the constraints are contradictory.
    """
    bodies = existing_bodies(nominal)
    for name, axes in known.symmetry.items():
        odd = sorted({k for axis in axes for k in _odd(name, axis)})
        # The mean of a body and its mirror image.
        bodies[_body(name, names), odd] = 0.0
    for name, (low, high) in known.centre_of_mass.items():
        i = _body(name, names)
        bodies[i] = _moved(bodies[i], _inside_box(name, known, bodies[i], low, high))
    masses = _masses(known, names, bodies[:, 0])
    return np.asarray(bodies * (masses / bodies[:, 0])[:, None])


def _ranges(
    known: BodyConstraints, names: Sequence[str], width: int
) -> Iterator[tuple[Array, float, float]]:
    for name, (low, high) in known.mass.items():
        if not (low <= high and high > 0):
            raise ValueError(f"mass of {name!r}: no body has a mass between {low} and {high} kg")
        yield _unit(10 * _body(name, names), width), float(low), float(high)
    if known.total_mass is not None:
        total = np.zeros(width)
        total[0 : 10 * len(names) : 10] = 1.0
        yield total, float(known.total_mass), float(known.total_mass)


def _centres(
    known: BodyConstraints, names: Sequence[str], width: int
) -> Iterator[tuple[Array, float, float]]:
    for name, (low, high) in known.centre_of_mass.items():
        for axis in range(3):
            if not low[axis] <= high[axis]:
                raise ValueError(
                    f"centre of mass of {name!r}: {'xyz'[axis]} between {low[axis]} and "
                    f"{high[axis]} m is empty"
                )
            row = _unit(10 * _body(name, names) + 1 + axis, width)
            yield row, float(low[axis]), float(high[axis])


def _inside_box(
    name: str, known: BodyConstraints, body: Array, low: Sequence[float], high: Sequence[float]
) -> Array:
    """Centre of mass of a body, moved into its permitted box."""
    box_low, box_high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    room = np.where(np.isfinite(box_high - box_low), INSIDE * (box_high - box_low), 1e-3)
    centre = np.clip(body[1:4] / body[0], box_low + room, box_high - room)
    for axis in known.symmetry.get(name, ""):
        k = "xyz".index(axis)
        if not (box_low[k] < 0 < box_high[k] or box_low[k] == 0 == box_high[k]):
            raise ValueError(
                f"{name!r} is symmetric about {axis} = 0, and so is its centre of mass; "
                f"centre_of_mass requires it to be between {box_low[k]} and {box_high[k]} m"
            )
        centre[k] = 0.0
    return np.asarray(centre)


def _moved(body: Array, centre: Array) -> Array:
    """A body moved to another centre of mass without rotation."""
    matrix = pseudo_inertia(body[None])[0]
    mass, first = matrix[3, 3], matrix[:3, 3].copy()
    matrix[:3, :3] += mass * np.outer(centre, centre) - np.outer(first, first) / mass
    matrix[:3, 3] = matrix[3, :3] = mass * centre
    return np.asarray(from_pseudo_inertia(matrix[None])[0])


def _masses(known: BodyConstraints, names: Sequence[str], nominal: Array) -> Array:
    """Masses inside their ranges, with the known total."""
    low, high = np.zeros(len(names)), np.full(len(names), np.inf)
    for name, (least, most) in known.mass.items():
        low[_body(name, names)], high[_body(name, names)] = max(0.0, least), most
    room = np.where(np.isfinite(high), INSIDE * (high - low), 0.0)

    def scaled(factor: float) -> Array:
        return np.clip(factor * nominal, low + room, high - room)

    if known.total_mass is None:
        return scaled(1.0)
    factors = np.array([1e-6, 1e6])
    if not scaled(factors[0]).sum() < known.total_mass < scaled(factors[1]).sum():
        if np.isclose(scaled(1.0).sum(), known.total_mass):
            return scaled(1.0)
        raise ValueError(
            f"total_mass={known.total_mass} kg is inconsistent with the masses of the bodies, "
            f"whose sum lies between {low.sum():.6g} and {high.sum():.6g} kg"
        )
    for _ in range(200):
        middle = float(np.sqrt(factors[0] * factors[1]))
        factors[int(scaled(middle).sum() > known.total_mass)] = middle
    masses = scaled(float(factors[0]))
    free = (masses > low + room) & (masses < high - room)
    masses[free] += (known.total_mass - masses.sum()) / max(1, free.sum())
    return masses


def _body(name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise ValueError(f"no body {name!r}; there are {', '.join(names)}")
    return list(names).index(name)


def _odd(name: str, axis: str) -> tuple[int, ...]:
    if axis not in _ODD:
        raise ValueError(
            f"symmetry of {name!r}: {axis!r} is not an axis; expected some of 'x', 'y', 'z'"
        )
    return _ODD[axis]


def _unit(k: int, width: int) -> Array:
    row = np.zeros(width)
    row[k] = 1.0
    return row


def _stacked(rows: Sequence[tuple[Array, float]], width: int) -> tuple[Array, Array]:
    matrix = np.array([row for row, _ in rows]).reshape(-1, width)
    return matrix, np.array([value for _, value in rows], dtype=float)


def _independent(rows: Array, values: Array) -> tuple[Array, Array]:
    """Equations without those that follow from others."""
    if not len(rows):
        return rows, values
    triangle, pivots = qr(rows.T, mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    kept = np.sort(pivots[: int(np.sum(diagonal > 1e-9 * diagonal[0]))])
    return rows[kept], values[kept]
