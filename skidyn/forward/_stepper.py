# SPDX-License-Identifier: BSD-3-Clause
r"""Implicit steps with set-valued friction, many trajectories at once.

A step has two stages of an L-stable method of second order [1]_: stiff controllers and heavy
damping are stable at any step. In each stage the velocity ``v`` and the direction of friction
``s`` solve

.. math:: f(q(v), v, \ddot q(v), s) = \tau, \qquad s_j \in \mathrm{Sgn}(v_j),

so that a joint is at rest where dry friction can hold it, and stays there [2]_. Stages in which a
joint stops, starts or turns are computed with the implicit Euler method, which does not oscillate.

References
----------
.. [1] R. Alexander (1977), Diagonally implicit Runge-Kutta methods for stiff ODEs, SIAM J. Numer.
   Anal. 14(6), 1006-1021.
.. [2] V. Acary, B. Brogliato (2008), Numerical Methods for Nonsmooth Dynamical Systems, Springer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array
from skidyn.forward._model import Conditions, ForwardModel

GAMMA = 1.0 - np.sqrt(0.5)
#: Most Newton steps and most exchanges of sticking and sliding joints, and the change of velocity,
#: relative to a moderate one, that ends them.
ITERATIONS, EXCHANGES, SMALL = 8, 25, 1e-10
#: Step of velocity for numerical derivatives, relative to a moderate velocity.
DIFFERENCE = 1e-5
#: Velocity (rad/s) beyond which the simulation of a trajectory ends.
LOST = 1e4

#: Torque of the drive at times (n_rows,), or at times, q and dq of the motors.
Feed = Callable[[Array], Array]
Drive = Callable[[Array, Array, Array], Array]


@dataclass
class State:
    """State of the rows: motors first, then the links that have separate coordinates.

    Attributes
    ----------
    q, dq : ndarray of shape (n_rows, n_joints + n_springs)
        Position and velocity.
    direction : ndarray of shape (n_rows, n_joints)
        Direction of dry friction, in [-1, 1]; inside where a joint is held.
    memory : ndarray of shape (n_rows, n_states)
        States of hysteresis.
    """

    q: Array
    dq: Array
    direction: Array
    memory: Array

    def put(self, rows: NDArray[np.int64], other: State) -> None:
        """Overwrite some rows."""
        for name in ("q", "dq", "direction", "memory"):
            getattr(self, name)[rows] = getattr(other, name)[rows]


class Stepper:
    """Advances the rows of a state."""

    def __init__(
        self,
        forward: ForwardModel,
        drive: Drive | None,
        torque_at: Feed | None,
        conditions: Conditions,
        theta: tuple[Array, Array] | None = None,
    ) -> None:
        self.forward, self.theta = forward, theta
        self.drive: Any = drive
        self.torque_at = torque_at
        self.conditions = conditions
        self.n = forward.n
        self.size = forward.n + len(forward.springs)
        elastic = [spring.joint for spring in forward.springs]
        self.unit = np.r_[forward.unit, forward.unit[elastic]]
        self._delta = DIFFERENCE * self.unit
        self._steps = np.zeros((self.size + 2, 1, self.size))
        self._steps[1:-1, 0] = np.diag(self._delta)

    # ------------------------------------------------------------------ equations
    def _residual(
        self,
        q: Array,
        v: Array,
        a: Array,
        direction: Array,
        old: State,
        fixed: Array | None,
        time: Array,
    ) -> Array:
        """Torque by which the equations fail; motion of shape (n_blocks, n_rows, size)."""
        n, forward = self.n, self.forward
        memory = self._memory(q, old)
        total, rigid = forward.torque(
            q[..., :n], v[..., :n], a[..., :n], direction, memory, self.conditions, self.theta
        )
        drive = self.drive(time, q[..., :n], v[..., :n]) if fixed is None else fixed
        if not forward.springs:
            return np.asarray(total - drive)
        # Springs: the torque of the spring replaces that of the rigid body at the motor.
        motor = total - rigid
        link = [x[..., :n].copy() for x in (q, v, a)]
        for k, spring in enumerate(forward.springs):
            for x, own in zip((q, v, a), link, strict=True):
                own[..., spring.joint] = x[..., n + k]
        q_link, v_link, a_link = link
        moved = forward.torque(
            q_link, v_link, a_link, direction, memory, self.conditions, self.theta
        )[1].copy()
        result = np.empty_like(q)
        result[..., :n] = motor + moved - drive
        for k, spring in enumerate(forward.springs):
            j = spring.joint
            twist, rate = q[..., j] - q[..., n + k], v[..., j] - v[..., n + k]
            touching = (np.abs(twist) > spring.gap / 2) | (spring.gap == 0.0)
            torque = spring.torque(twist) + spring.damping * rate * touching
            result[..., j] += torque - moved[..., j]
            result[..., n + k] = moved[..., j] - torque
        return result

    def _memory(self, q: Array, old: State) -> Array:
        """States of hysteresis after a straight path from the old positions."""
        memories = self.forward.memories
        states = np.empty((*q.shape[:2], len(memories)))
        for k, memory in enumerate(memories):
            way = q[..., memory.joint] - old.q[:, memory.joint]
            states[..., k] = memory.law(old.memory[:, k], np.sign(way), np.abs(way))
        return states

    # ------------------------------------------------------------------ one stage
    def _stage(
        self, base_q: Array, base_v: Array, weight: Array, old: State, guess: State, time: Array
    ) -> tuple[State, Array]:
        """State and acceleration at which ``q = base_q + weight v`` and the equations hold."""
        n, size, rows = self.n, self.size, len(base_q)
        w = weight[:, None]
        v, s = guess.dq, guess.direction
        fixed = self.torque_at(time) if self.torque_at is not None else None
        slope = level = None
        steps = self._steps
        for iteration in range(ITERATIONS):
            # The derivatives are computed again where those of the previous iteration do not
            # suffice.
            fresh = slope is None or iteration > 2
            if fresh:
                # Blocks: unchanged; each velocity a little larger; directions larger by 1.
                trial = v + steps
                direction = np.empty((size + 2, rows, n))
                direction[:-1] = s
                direction[-1] = s + 1.0
            else:
                trial, direction = v[None], s[None]
            values = self._residual(
                base_q + w * trial, trial, (trial - base_v) / w, direction, old, fixed, time
            )
            here = values[0]
            if fresh:
                slope = np.moveaxis(values[1:-1] - here, 0, -1) / self._delta
                level = (values[-1] - here)[:, :n]
            assert slope is not None and level is not None
            new_v, new_s = _inclusion(here, slope, level, v, s)
            change = float(np.abs((new_v - v) / self.unit).max())
            v, s = new_v, new_s
            if iteration and not change > SMALL * max(1.0, float(np.abs(v).max())):
                break
        q = base_q + w * v
        memory = self._memory(q[None], old)[0]
        return State(q, v, s, memory), (v - base_v) / w

    def step(self, old: State, time: Array, h: Array) -> State:
        """State after a step of each row's own length h (s)."""
        weight = GAMMA * h
        first, rate = self._stage(old.q, old.dq, weight, old, old, time + weight)
        rest = ((1.0 - GAMMA) * h)[:, None]
        base_q, base_v = old.q + rest * first.dq, old.dq + rest * rate
        turned = np.any(np.abs(first.direction - old.direction) > 1e-9, axis=1)
        if turned.any():
            t = turned[:, None]
            base_q, base_v = np.where(t, first.q, base_q), np.where(t, first.dq, base_v)
            weight = np.where(turned, (1.0 - GAMMA) * h, weight)
        second, _ = self._stage(base_q, base_v, weight, old, first, time + h)
        return second


def _inclusion(here: Array, slope: Array, level: Array, v: Array, s: Array) -> tuple[Array, Array]:
    """Velocity and direction that solve the linearised equations with ``s_j in Sgn(v_j)``.

    Joints that stick have ``v = 0`` and an unknown s, those that slide ``s = +-1`` and an unknown
    v; joints change sides until all are consistent (primal-dual active set).
    """
    rows, size = v.shape
    n = level.shape[1]
    own_v, own_here = (v, here) if size == n else (v[:, :n], here[:, :n])
    dry = level > 1e-12 * (1.0 + np.abs(own_here))
    # Without dry friction nothing depends on the direction.
    s = np.where(dry, s, np.sign(own_v))
    stuck = dry & (np.abs(s) < 1.0)
    side = np.where(s >= 0, 1.0, -1.0)
    # right side: slope (v_new - v) + here + level (s_new - s) = 0
    constant = np.einsum("rij,rj->ri", slope, v) - here
    constant[:, :n] += level * s * dry
    if not stuck.any():
        x = v + _solved(slope, -here)
        if not np.any(dry & (x[:, :n] * side < 0)):
            return x, np.where(dry, side, np.sign(x[:, :n]))
    open_rows = np.arange(rows)
    result_v, result_s = np.zeros_like(v), np.zeros_like(s)
    for _ in range(EXCHANGES):
        matrix = slope[open_rows].copy()
        right = constant[open_rows].copy()
        held, sliding = stuck[open_rows], (dry & ~stuck)[open_rows]
        r, j = np.nonzero(held)
        matrix[r, :, j] = 0.0
        matrix[r, j, j] = level[open_rows][r, j]
        right[:, :n] -= np.where(sliding, level[open_rows] * side[open_rows], 0.0)
        x = _solved(matrix, right)
        result_v[open_rows] = x
        result_v[open_rows[r], j] = 0.0
        result_s[open_rows] = np.where(
            held, x[:, :n], np.where(sliding, side[open_rows], np.sign(x[:, :n]))
        )
        slips = held & (np.abs(x[:, :n]) > 1.0)
        stops = sliding & (x[:, :n] * side[open_rows] < 0)
        wrong = slips | stops
        if not wrong.any():
            break
        bad = wrong.any(axis=1)
        moved = open_rows[bad]
        side[moved] = np.where(slips[bad], np.sign(x[bad, :n]), side[moved])
        stuck[moved] = (stuck[moved] & ~slips[bad]) | stops[bad]
        open_rows = moved
    return result_v, np.clip(result_s, -1.0, 1.0)


def _solved(matrix: Array, right: Array) -> Array:
    if matrix.shape[1] == 1:  # a single axis: the call of LAPACK takes longer than its computation
        return right / matrix[:, 0]
    # Rows that have diverged would spoil the solution of all others.
    with np.errstate(all="ignore"):
        determinant = np.linalg.det(matrix)
    gone = ~(np.isfinite(determinant) & (determinant != 0.0) & np.isfinite(right).all(axis=1))
    if gone.any():
        matrix[gone], right[gone] = np.eye(matrix.shape[1]), np.nan
    return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0])
