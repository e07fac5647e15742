# SPDX-License-Identifier: BSD-3-Clause
"""Least squares over physically possible bodies, by a primal-dual interior-point method.

Every body has a pseudo-inertia P and a dual matrix Z; both stay positive definite and ``P Z`` is
driven to a multiple ``mu`` of the identity, ``mu`` to zero. In the scaling of Nesterov and Todd, in
which P and Z are the same diagonal matrix, each step is ordinary least squares.

References
----------
Y. Nesterov, M. Todd (1997), Self-scaled barriers and interior-point methods for convex programming,
Mathematics of Operations Research 22(1), 1-42.
S. Boyd, L. Vandenberghe (2004), Convex Optimization, chapter 11.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from skidyn._signals import Array
from skidyn.identification._log_det import (
    BASIS,
    SYMMETRIC,
    Linear,
    from_pseudo_inertia,
    local_units,
    pseudo_inertia,
    taken_inside,
)

#: Most steps; some 20 are needed.
MOST_STEPS = 80
#: Gap to the optimum at which the steps end, for targets of unit size per row.
GAP = 1e-11
#: Weight of the nominal bodies, in units of the data, for directions without data.
PULL = 1e-5
#: Share of the distance to the border of the possible bodies that one step may take.
TOWARD_BORDER = 0.95
#: Least share of the present gap that a step aims at.
LEAST_CENTRING = 1e-4
#: Steps shorter than this end the search; number of full steps after which it has converged.
SHORTEST, SETTLED = 1e-8, 4


@dataclass
class _Point:
    """Unknowns and their duals."""

    x: Array
    bodies: Array
    slack: Array
    duals: Array
    multipliers: Array

    @property
    def gap(self) -> float:
        """How far the error can be from its optimum, per eigenvalue."""
        products = float(np.einsum("nij,nji->", self.bodies, self.duals))
        count = 4 * len(self.bodies) + len(self.slack)
        return (products + float(self.slack @ self.multipliers)) / count

    @property
    def exists(self) -> bool:
        """Whether P and Z are still positive definite after rounding; else the search ends."""
        try:
            np.linalg.cholesky(np.concatenate([self.bodies, self.duals]))
        except np.linalg.LinAlgError:
            return False
        return True


@dataclass(frozen=True)
class _Data:
    """The objective ``|factor x - target|^2 / 2 + cost x``."""

    factor: Array
    target: Array
    cost: Array


@dataclass
class _Direction:
    """A step: of the unknowns, of P and Z in the common scaling, of slacks and multipliers."""

    step: Array
    change: Array
    answer: Array
    slack: Array
    multipliers: Array


def solve_interior_point(
    factor: Array, target: Array, start: Array, nominal: Array, linear: Linear
) -> Array:
    """Least squares over physically possible bodies, strictly inside all limits.

    Columns and torque are of unit size; ``start`` are bodies and coefficients that satisfy all
    constraints strictly, and undetermined directions are drawn toward the ``nominal`` bodies.
    """
    n, p = nominal.size, len(start)
    whole, _ = local_units(nominal, nominal)
    pull = PULL * np.eye(p)
    pull[:n, :n] = PULL * np.linalg.inv(block_diag(*whole))
    rest = start.copy()
    rest[:n] = nominal.ravel()
    data = _Data(*_triangular(np.vstack([factor, pull]), np.r_[target, pull @ rest]), np.zeros(p))
    point = _start(data, start, nominal, linear, GAP)
    for _ in range(MOST_STEPS):
        if point.gap < GAP or not point.exists:
            break
        point, length = _step(point, data, linear, 0.0)
        if length < SHORTEST:
            break
    return taken_inside(point.x, start, n, linear)


def minimise_with_divergence(
    factor: Array, target: Array, start: Array, nominal: Array, weight: float
) -> Array:
    """Minimum of ``|factor x - target|^2 / 2 + weight divergence(bodies, nominal)``.

    The unknowns are parameters of bodies, which exist at the start and in the result, and then
    coefficients.
    """
    n, p = nominal.size, len(start)
    held = np.diag(np.r_[np.zeros(n), np.full(p - n, PULL)])
    # The divergence is a linear cost, the trace, and the barrier of the method itself.
    cost = np.zeros(p)
    inverse = np.linalg.inv(pseudo_inertia(nominal))
    cost[:n] = weight * np.einsum("nij,aji->na", inverse, BASIS).ravel()
    data = _Data(*_triangular(np.vstack([factor, held]), np.r_[target, held @ start]), cost)
    linear = Linear.none(p)
    point = _start(data, start, nominal, linear, weight)
    settled = 0
    for _ in range(MOST_STEPS):
        point, length = _step(point, data, linear, weight)
        settled = settled + 1 if length == 1.0 and abs(point.gap / weight - 1) < 0.01 else 0
        if settled == SETTLED or length < SHORTEST or not point.exists:
            break
    return taken_inside(point.x, start, n, linear)


def _start(data: _Data, start: Array, nominal: Array, linear: Linear, least: float) -> _Point:
    """Duals large enough for the gradient; else the steps along the border would be very short."""
    n = nominal.size
    bodies = pseudo_inertia(start[:n].reshape(-1, 10))
    slack = linear.b - linear.C @ start
    own, _ = local_units(start[:n].reshape(-1, 10), nominal)
    gradient = data.factor.T @ (data.target - data.factor @ start) - data.cost
    gradient[:n] = block_diag(*own).T @ gradient[:n]
    mu = max(least, float(np.linalg.norm(gradient)))
    duals = np.asarray(mu * np.linalg.inv(bodies))
    return _Point(start.copy(), bodies, slack, duals, mu / slack)


def _triangular(factor: Array, target: Array) -> tuple[Array, Array]:
    q, triangle = np.linalg.qr(factor)
    return triangle, q.T @ target


def _step(point: _Point, data: _Data, linear: Linear, least: float) -> tuple[_Point, float]:
    """One step of Mehrotra's predictor and corrector, toward products of at least ``least``."""
    equations = _Equations(point, data, linear)
    ahead = equations.direction(least, np.zeros_like(point.bodies), np.zeros_like(point.slack))
    share = max((1 - min(1.0, equations.reach(ahead))) ** 3, LEAST_CENTRING)
    mu = max(least, share * point.gap)
    bent = ahead.change @ ahead.answer
    found = equations.direction(
        mu, (bent + bent.transpose(0, 2, 1)) / 2, ahead.slack * ahead.multipliers
    )
    length = min(1.0, TOWARD_BORDER * equations.reach(found))
    return equations.moved(found, length), length


class _Equations:
    """Equations of a step from a point, in the scaling in which P and Z are the same."""

    def __init__(self, point: _Point, data: _Data, linear: Linear) -> None:
        self.point, self.linear = point, linear
        n, p = 10 * len(point.bodies), len(point.x)
        roots, self.inverse_roots, self.scaled = _scaling(point.bodies, point.duals)
        changes = np.einsum("nij,ajk,nlk->nail", roots, SYMMETRIC, roots)
        own = from_pseudo_inertia(changes.reshape(-1, 4, 4)).reshape(-1, 10, 10)
        self.units = block_diag(*own.transpose(0, 2, 1), np.eye(p - n))
        self.stiffness = np.sqrt(point.multipliers / point.slack)
        held = np.eye(p)[:n]
        limits = self.stiffness[:, None] * (linear.C @ self.units)
        rows = np.vstack([data.factor @ self.units, held, limits])
        self.free = _null_space(linear.E @ self.units) if len(linear.e) else np.eye(p)
        self.q, self.triangle = np.linalg.qr(rows @ self.free)
        self.left = data.target - data.factor @ point.x
        self.price = solve_triangular(
            self.triangle, self.free.T @ (self.units.T @ data.cost), trans="T"
        )

    def direction(self, mu: float, second: Array, third: Array) -> _Direction:
        """Step toward products of ``mu``; the others are their parts of second order."""
        point, scaled = self.point, self.scaled
        n = 10 * len(point.bodies)
        sums = (scaled[:, :, None] + scaled[:, None]) / 2
        # Target values of the products P Z and of slack times multiplier, minus the present ones.
        lacking = (mu * np.eye(4) - _diagonal(scaled**2) - second) / sums
        answer = _diagonal(scaled) + lacking
        wanted_multipliers = (mu - third) / point.slack
        wanted = np.r_[
            self.left,
            np.einsum("nij,aji->na", answer, SYMMETRIC).ravel(),
            -wanted_multipliers / self.stiffness,
        ]
        own_step = self.free @ solve_triangular(self.triangle, self.q.T @ wanted - self.price)
        step = self.units @ own_step
        change = np.einsum("na,aij->nij", own_step[:n].reshape(-1, 10), SYMMETRIC)
        ds = -self.linear.C @ step
        dm = wanted_multipliers - point.multipliers - self.stiffness**2 * ds
        return _Direction(step, change, lacking - change, ds, dm)

    def reach(self, d: _Direction) -> float:
        """Longest step inside the limits."""
        root = 1 / np.sqrt(self.scaled)
        rates = [
            np.linalg.eigvalsh(root[:, :, None] * m * root[:, None]) for m in (d.change, d.answer)
        ]
        rates += [d.slack / self.point.slack, d.multipliers / self.point.multipliers]
        worst = min(float(np.min(rate, initial=0.0)) for rate in rates)
        return -1 / min(worst, -1e-6)

    def moved(self, d: _Direction, length: float) -> _Point:
        """The point after a step of some length."""
        x = self.point.x + length * d.step
        duals = _diagonal(self.scaled) + length * d.answer
        back = self.inverse_roots
        return _Point(
            x,
            pseudo_inertia(x[: 10 * len(self.point.bodies)].reshape(-1, 10)),
            self.linear.b - self.linear.C @ x,
            np.einsum("nji,njk,nkl->nil", back, duals, back),
            self.point.multipliers + length * d.multipliers,
        )


def _scaling(bodies: Array, duals: Array) -> tuple[Array, Array, Array]:
    """G with ``G^-1 P G^-T = G^T Z G`` diagonal, its inverse, and the diagonals."""
    first, second = np.linalg.cholesky(bodies), np.linalg.cholesky(duals)
    _, values, right = np.linalg.svd(second.transpose(0, 2, 1) @ first)
    shrink = 1 / np.sqrt(values)
    roots = first @ right.transpose(0, 2, 1) * shrink[:, None]
    inverse = np.linalg.solve(first, np.broadcast_to(np.eye(4), first.shape))
    return roots, (1 / shrink)[:, :, None] * (right @ inverse), values


def _diagonal(values: Array) -> Array:
    return np.asarray(values[:, :, None] * np.eye(4))


def _null_space(rows: Array) -> Array:
    return np.asarray(np.linalg.qr(rows.T, mode="complete")[0][:, len(rows) :])
