# SPDX-License-Identifier: BSD-3-Clause
"""The controller of a robot, and its gains from a log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._columns import command_columns
from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn._text import joints_of

#: Settings of which every joint may have its own.
PER_JOINT = ("stiffness", "damping", "limit", "deadband", "offset", "no_load_speed")


@dataclass(frozen=True)
class Controller:
    r"""Proportional-derivative control of the joints.

    .. math:: \tau = \mathrm{clip}\left(k\,(q_\mathrm{ref} - q)
        + d\,(\dot q_\mathrm{ref} - \dot q) + \tau_0,\ \pm L - L\,\dot q / \omega_0\right)

    Parameters
    ----------
    stiffness : float or array-like of shape (n_joints,)
        Gain of the position error, N m/rad (N/m for sliding joints).
    damping : float or array-like of shape (n_joints,), default=0.0
        Gain of the velocity error, N m s/rad (N s/m).
    limit : float or array-like of shape (n_joints,), default=inf
        Largest torque of the drive, N m (N): a current limit.
    delay : float, default=0.0
        Delay with which the reference reaches the controller, s.
    deadband : float or array-like of shape (n_joints,), default=0.0
        Position error, rad (m), within which the controller output is zero.
    offset : float or array-like of shape (n_joints,), default=0.0
        Constant torque, N m (N).
    follows_velocity : bool, default=True
        Whether the velocity of the reference is fed forward; if False, the velocity itself is
        damped, as in position servos.
    no_load_speed : float or array-like of shape (n_joints,), default=inf
        Speed at which the whole voltage is needed for the motion, rad/s (m/s): the largest torque
        decreases linearly from ``limit`` at rest to zero at this speed. Infinite for a limit of the
        current alone.

    Examples
    --------
    >>> from skidyn.simulation import Controller
    >>> Controller(stiffness=160.18 * 243.45, damping=243.45, follows_velocity=False).damping
    243.45
    """

    stiffness: Any
    damping: Any = 0.0
    limit: Any = np.inf
    delay: float = 0.0
    deadband: Any = 0.0
    offset: Any = 0.0
    follows_velocity: bool = True
    no_load_speed: Any = np.inf

    def checked(self, n_joints: int) -> Controller:
        """Controller with one number for each joint.

        Parameters
        ----------
        n_joints : int
            Number of joints.

        Returns
        -------
        Controller
            Controller whose gains are arrays of shape (n_joints,).

        Raises
        ------
        SkidynError
            A gain is negative or does not have one number for each joint, or ``no_load_speed`` is
            given without a finite ``limit``.
        """
        values: dict[str, Any] = {}
        for name in PER_JOINT:
            value = np.asarray(getattr(self, name), dtype=float)
            signed = name == "offset"
            if value.shape not in ((), (n_joints,)) or not (signed or np.all(value >= 0)):
                raise SkidynError(
                    f"{name} of the controller is {getattr(self, name)!r}; expected a number of at "
                    f"least 0, or one for each of the {n_joints} joints"
                )
            values[name] = np.broadcast_to(value, (n_joints,)).copy()
        falls = np.isfinite(values["no_load_speed"])
        if np.any(falls & (~np.isfinite(values["limit"]) | (values["no_load_speed"] == 0))):
            raise SkidynError(
                f"no_load_speed of the controller is {self.no_load_speed!r}, with the limit "
                f"{self.limit!r}; expected a speed above 0, and as limit the torque at rest"
            )
        return Controller(**values, delay=float(self.delay), follows_velocity=self.follows_velocity)

    def with_joint(self, n_joints: int, joint: int, **settings: float) -> Controller:
        """Controller with other settings of one joint.

        Parameters
        ----------
        n_joints : int
            Number of joints.
        joint : int
            Joint, counted from 1.
        **settings : float
            ``stiffness``, ``damping``, ``limit``, ``deadband``, ``offset`` or ``no_load_speed`` of
            this joint, in the units above.

        Returns
        -------
        Controller
            Controller whose gains are arrays of shape (n_joints,).

        Raises
        ------
        SkidynError
            The robot has no such joint, a controller has no such setting for single joints, or a
            setting is negative.

        Examples
        --------
        >>> from skidyn.simulation import Controller
        >>> Controller(40.0).with_joint(2, 2, limit=1.5).limit
        array([inf, 1.5])
        """
        if not 1 <= joint <= n_joints:
            raise SkidynError(f"no joint {joint}; the robot has {joints_of(n_joints)}")
        strange = sorted(set(settings) - set(PER_JOINT))
        if strange:
            raise SkidynError(
                f"a controller has no {strange[0]} for single joints; expected one of "
                f"{', '.join(PER_JOINT)}"
            )
        changed = self.checked(n_joints)
        for name, value in settings.items():
            getattr(changed, name)[joint - 1] = value
        return changed.checked(n_joints)

    def torque(self, q: Array, dq: Array, q_ref: Array, dq_ref: Array) -> Array:
        """Torque of the drive.

        Parameters
        ----------
        q, dq : ndarray of shape (n_samples, n_joints)
            Position (rad, m) and velocity.
        q_ref, dq_ref : ndarray of shape (n_samples, n_joints)
            Position and velocity of the reference as received by the controller.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            N m or N.
        """
        error = q_ref - q
        error = np.sign(error) * np.maximum(np.abs(error) - self.deadband, 0.0)
        wanted = dq_ref if self.follows_velocity else 0.0
        torque = self.stiffness * error + self.damping * (wanted - dq) + self.offset
        beyond = self.fall * dq
        return np.asarray(np.clip(torque, -self.limit - beyond, self.limit - beyond))

    @property
    def fall(self) -> Any:
        """By how much the limit falls with the speed, N m s/rad (N s/m)."""
        speed = np.asarray(self.no_load_speed, dtype=float)
        falls = np.isfinite(speed)
        return np.where(falls, self.limit, 0.0) / np.where(falls, speed, 1.0)


def fit_controller(log: Any, torque: Any, *, follows_velocity: bool | None = None) -> Controller:
    """Gains of a controller from reference, motion and torque.

    Least squares of the torque on position error, velocity error and a constant, joint by joint.
    The delay of the reference is the best-fitting one from 0 to 50 ms, in steps of the log.

    Parameters
    ----------
    log : DataFrame
        ``time`` (s), ``q1..``, ``dq1..`` and the reference ``q_ref1..`` or ``cmd1..``
        (rad, m).
    torque : array-like of shape (n_samples, n_joints)
        Torque of the drive, N m or N.
    follows_velocity : bool or None, default=None
        Whether the velocity of the reference is fed forward; None selects the better fit.

    Returns
    -------
    Controller
        Negative gains are set to 0; they occur only if the log does not show the effect of the
        gain.

    Raises
    ------
    SkidynError
        A column is missing.

    Examples
    --------
    >>> import numpy as np
    >>> import pandas as pd
    >>> from skidyn.simulation import fit_controller
    >>> t = np.linspace(0, 4, 2001)
    >>> log = pd.DataFrame({"time": t, "q_ref1": np.sin(t), "q1": np.sin(t - 0.02)})
    >>> log["dq1"] = np.cos(t - 0.02)
    >>> torque = 50 * (log["q_ref1"] - log["q1"]) - 2 * log["dq1"]
    >>> found = fit_controller(log, torque)
    >>> found.stiffness.round(3).tolist(), found.damping.round(3).tolist(), found.follows_velocity
    ([50.0], [2.0], False)
    """
    table, y = log, np.asarray(torque, dtype=float)
    y = y.reshape(len(y), -1)
    n = y.shape[1]
    names = [f"{s}{j + 1}" for s in ("q", "dq") for j in range(n)]
    lost = [name for name in ["time", *names] if name not in list(table.columns)]
    if lost:
        raise SkidynError(f"the log lacks the column(s) {', '.join(lost)}; a controller needs them")
    commands = command_columns(list(table.columns), [f"joint{j + 1}" for j in range(n)])
    time = np.asarray(table["time"], dtype=float)
    q, dq, ref = (
        np.column_stack([np.asarray(table[name], dtype=float) for name in own])
        for own in (names[:n], names[n:], commands)
    )
    rate = np.gradient(ref, time, axis=0)
    step = float(np.median(np.diff(time)))
    delays = np.arange(0, max(1, round(0.05 / step)) + 1)
    options = [True, False] if follows_velocity is None else [follows_velocity]
    best: tuple[float, Any] = (np.inf, None)
    for feeds in options:
        for shift in delays:
            rows = slice(shift, None)
            late = slice(None, len(ref) - shift)
            total, gains = 0.0, []
            for j in range(n):
                error = ref[late, j] - q[rows, j]
                speed = (rate[late, j] if feeds else 0.0) - dq[rows, j]
                design = np.column_stack([error, speed, np.ones(len(error))])
                size = np.linalg.norm(design, axis=0)
                size[size == 0] = 1.0
                found = np.linalg.lstsq(design / size, y[rows, j], rcond=1e-9)[0] / size
                residual = y[rows, j] - design @ found
                total += float(np.mean(residual**2) / (np.var(y[:, j]) + 1e-300))
                gains.append(found)
            if total < best[0] * (1 - 1e-6):
                best = total, (feeds, shift * step, np.array(gains))
    feeds, delay, gains = best[1]
    return Controller(
        np.maximum(gains[:, 0], 0.0),
        np.maximum(gains[:, 1], 0.0),
        delay=delay,
        offset=gains[:, 2],
        follows_velocity=feeds,
    )
