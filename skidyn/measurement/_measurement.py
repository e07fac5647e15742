# SPDX-License-Identifier: BSD-3-Clause
"""The measurement to be checked, with quantities that several checks use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from skidyn._repeated import repeated_rows
from skidyn._sensor_steps import position_step
from skidyn._signals import Array, Signals, rates_of
from skidyn._text import listed
from skidyn.measurement._consistency import velocity_consistency
from skidyn.measurement._leaps import find_leaps
from skidyn.measurement._measures import (
    COARSE,
    channel_step,
    excited,
    held_share,
    idle_rows,
    longest_plateau_share,
    lost_parts,
    missing_values,
    step_share,
)
from skidyn.measurement._results import Results
from skidyn.measurement._wraps import TURN, wrap_period

if TYPE_CHECKING:
    from skidyn.measurement._divided import Division
    from skidyn.measurement._fits import Fits
    from skidyn.measurement._odd_motion import MotionByRecording
    from skidyn.robots import Robot


#: What :meth:`Measurement.once` computes.
_Made = TypeVar("_Made")
#: Correlation of integrated velocity with position from which its slope is a scale, and largest
#: difference of the slopes of joints with a common one.
ALIKE, SHARED = 0.9, 0.05
#: Step of a velocity or torque, as a share of its spread, that is reported.
NOTED_STEP = 0.1
#: Fewest fourth differences of a torque that show its noise.
ENOUGH = 200
#: Share of the steps in which the position of a single joint is held.
HELD_BY_ONE = 0.4
#: Share of its range that a joint covers in a recording in which it moves.
MOVES = 0.1


@dataclass
class Measurement:
    """Recorded motion and torque, and the description of the robot.

    Parameters
    ----------
    signals : Signals
        Recorded motion; its positions and velocities are used as they are.
    torque : ndarray of shape (n_samples, n_joints), N m or N
        Recorded torque.
    robot : Robot or None
        Robot according to its description; checks that need it are left out without it. That of
        its units replaces one whose masses, centers of mass or inertias are in other units.
    joint_names : sequence of str
        Names for sentences and remedies.
    identified : bool, optional
        Whether bodies will be identified, so that those of the description may be wrong; unknown by
        default.
    of_servos : bool, default=False
        Whether the torque was computed from the commands of position servos, without a torque
        sensor.
    same_stamps : int, optional
        Rows that had the time stamp of the previous row although joints moved; ``signals`` then
        have an even clock.
    late_position, readable, stale, lost, shuffled, odd, one_zero, dead, scaled, smoothed : optional
        Results of checks that are used by other checks; set by them.
    computed, frictionless, mixed : optional
        Results of checks that are used by other checks; set by them.
    clock : float, optional
        Number of units of the clock in a second; set by its check.
    millimetres : set of int, optional
        Joints, from 0, whose positions are reported to be in millimetres; set by their check.
    slow : set of int, optional
        Joints, from 0, whose torque alone is reported to come from a slower bus; set by its checks.
    held_velocities : set of int, optional
        Joints, from 0, whose velocity is reported to hold its last value; set by their check.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.logs import check_log
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=4.0)
    >>> flipped = log.frame.assign(dq2=-log.frame["dq2"])
    >>> check_log(flipped, log.robot).checks[0].check
    'velocity'
    """

    signals: Signals
    torque: Array
    robot: Robot | None
    joint_names: Sequence[str]
    identified: bool | None = None
    of_servos: bool = False
    same_stamps: int = 0
    late_position: float = field(default=0.0, repr=False)
    readable: bool = field(default=True, repr=False)
    stale: bool = field(default=False, repr=False)
    lost: bool = field(default=False, repr=False)
    shuffled: bool = field(default=False, repr=False)
    odd: bool = field(default=False, repr=False)
    one_zero: Division | None = field(default=None, repr=False)
    dead: bool = field(default=False, repr=False)
    scaled: bool = field(default=False, repr=False)
    smoothed: bool = field(default=False, repr=False)
    computed: bool = field(default=False, repr=False)
    frictionless: bool = field(default=False, repr=False)
    mixed: bool = field(default=False, repr=False)
    clock: float = field(default=1.0, repr=False)
    millimetres: set[int] = field(default_factory=set, repr=False)
    slow: set[int] = field(default_factory=set, repr=False)
    held_velocities: set[int] = field(default_factory=set, repr=False)
    #: The motion before trajectories were cut and gaps of the clock were closed.
    recorded: Signals = field(init=False, repr=False)
    #: Rows to which positions jump; trajectories end before them.
    leaps: Array = field(init=False, repr=False)
    #: Rows before which the clock has a gap that the motion does not have; it is closed.
    false_gaps: NDArray[np.intp] = field(init=False, repr=False)
    _kept: Results = field(init=False, default_factory=Results, repr=False)

    def __post_init__(self) -> None:
        self.recorded = self.signals
        self._close_false_gaps()
        s = self.signals
        self.leaps = find_leaps(s.q, s.clock, s.trajectory)
        if len(self.leaps):  # no other check should interpret a jump as motion
            self.cut(self.leaps.astype(np.intp))

    def _close_false_gaps(self) -> None:
        """An even clock in place of one with gaps that the motion does not have."""
        from skidyn.measurement._arrival import rows_after_false_gaps, without_false_gaps

        s = self.signals
        self.false_gaps = rows_after_false_gaps(s.clock, s.q, s.trajectory)
        if len(self.false_gaps):  # other mistakes are visible only with an even clock
            self.signals = s.with_(time=without_false_gaps(s.clock, s.trajectory, self.false_gaps))

    def cut(self, rows: NDArray[np.intp]) -> None:
        """End trajectories before some rows, for all checks that follow.

        Parameters
        ----------
        rows : ndarray of int
            First rows of new trajectories.
        """
        s = self.signals
        first = np.zeros(s.n_samples, dtype=np.int64)
        first[1:] = ~s.within
        first[rows] = 1
        self.signals = s.with_(trajectory=np.cumsum(first))
        self._forget()

    def leave_out(self, rows: NDArray[np.bool_]) -> None:
        """Leave rows out, for all checks that follow.

        Velocities that are differences of the positions become those of the rows that are left.

        Parameters
        ----------
        rows : ndarray of shape (n_samples,) of bool
            Rows that were not read.
        """
        s, left = self.recorded, self.recorded.take(~rows)
        if np.allclose(s.dq, rates_of(s.q, s.clock, s.segments)):
            left = left.with_(dq=rates_of(left.q, left.clock, left.segments))
        self.signals, self.torque = left, self.torque[~rows]
        self._forget()
        self.__post_init__()

    def _forget(self) -> None:
        """Forget what was computed from other rows or trajectories."""
        for name, value in vars(type(self)).items():
            if isinstance(value, cached_property):
                self.__dict__.pop(name, None)
        self._kept = Results()

    def once(self, name: str, make: Callable[[], _Made]) -> _Made:
        """Result of ``make`` that several checks use, computed at the first call.

        Parameters
        ----------
        name : str
            Name of the result.
        make : callable
            Function that computes it.

        Returns
        -------
        object
            What ``make`` returned; it must not be changed.
        """
        return self._kept.get(name, None, make)

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return self.signals.n_joints

    @property
    def n_samples(self) -> int:
        """Number of rows."""
        return self.signals.n_samples

    def joint(self, k: int) -> str:
        """Name of a joint for a sentence.

        Parameters
        ----------
        k : int
            Joint, counted from 0.

        Returns
        -------
        str
            Its number, counted from 1, and its name where it has one.
        """
        name = str(self.joint_names[k])
        return name if name == f"joint {k + 1}" else f"joint {k + 1} ({name})"

    def joints(self, joints: Iterable[int]) -> str:
        """Names of several joints for a sentence.

        Parameters
        ----------
        joints : iterable of int
            Joints, counted from 0.

        Returns
        -------
        str
            As of :meth:`joint`, joined by commas and "and".
        """
        return listed([self.joint(int(k)) for k in joints])

    @cached_property
    def steps(self) -> Array:
        """Time steps inside trajectories, s."""
        return np.asarray(np.diff(self.signals.clock)[self.signals.within])

    @property
    def rate(self) -> float:
        """Median sampling rate, Hz."""
        return self.signals.rate

    @cached_property
    def jitter(self) -> float:
        """Half the width between the 5 % and 95 % quantiles of the steps, over their median."""
        spreads = []
        for rows in self.signals.segments:
            steps = np.diff(self.signals.clock[rows])
            if len(steps):
                low, middle, high = np.quantile(steps, [0.05, 0.5, 0.95])
                spreads.append((high - low) / 2 / middle if middle > 0 else 0.0)
        return float(np.median(spreads)) if spreads else 0.0

    @cached_property
    def gaps(self) -> Array:
        """Steps longer than 5 median steps inside trajectories, s."""
        return np.asarray(self.steps[self.steps > 5 / self.rate])

    @cached_property
    def whole(self) -> Signals:
        """Motion without samples that jump away and back, which a diagnosis omits as well."""
        from skidyn.evidence import without_broken_positions  # with it all columns of the evidence

        return self.signals if self.signals.time is None else without_broken_positions(self.signals)

    @cached_property
    def velocities(self) -> list[tuple[float, float]]:
        """Slope and correlation of integrated velocity on position, by joint."""
        s = self.whole
        fresh = ~repeated_rows(s)
        s = s if fresh.all() else s.take(fresh)
        odd = list(self.odd_motion)
        parts = [rows for rows in s.segments if s.trajectory[rows.start] not in odd]
        return [
            velocity_consistency(s.clock, self.unwrapped[fresh, k], s.dq[:, k], parts)
            for k in range(self.n_joints)
        ]

    @cached_property
    def motion_by_recording(self) -> MotionByRecording | None:
        """How velocities follow positions in every recording; None with too few to compare."""
        if len(self.leaps) or self.lost:
            return None  # parts between leaps have no numbers of their own
        from skidyn.measurement._odd_motion import FEWEST, MotionByRecording

        if len(np.unique(self.whole.trajectory)) < FEWEST:
            return None
        kept = ~self.idle
        whole, q = self.whole, self.unwrapped
        if not kept.all():
            whole, q = whole.take(kept), q[kept]
        return MotionByRecording.of(whole, q, self.velocity_steps)

    @cached_property
    def odd_motion(self) -> dict[int, dict[int, float]]:
        """Recordings in which velocities are not the usual multiple of the rate of positions."""
        from skidyn.measurement._odd_motion import odd_motion

        motion = self.motion_by_recording
        return {} if motion is None else odd_motion(motion)

    @cached_property
    def periods(self) -> dict[int, float]:
        """Sizes of the jumps of positions that begin anew after a range, by joint from 0."""
        s = self.signals
        found = {k: wrap_period(s.q[:, k], s.trajectory) for k in range(self.n_joints)}
        return {k: period for k, period in found.items() if period is not None}

    @cached_property
    def unwrapped(self) -> Array:
        """Positions without jumps by a turn, if they stay within one, or by another range.

        Recordings of such a position may also differ by a turn.
        """
        q = self.whole.q.copy()
        for k in range(self.n_joints):
            turn = self.periods.get(k, np.nan if self.signals.prismatic[k] else TURN)
            if not np.ptp(q[:, k]) < 1.1 * turn:
                continue
            for rows in self.signals.segments:
                q[rows, k] = np.unwrap(q[rows, k], period=turn)
            if np.array_equal(q[:, k], self.whole.q[:, k]):
                continue
            middles = [float(np.median(q[rows, k])) for rows in self.signals.segments]
            for rows, own in zip(self.signals.segments, middles, strict=True):
                q[rows, k] -= turn * np.round((own - middles[0]) / turn)
        return q

    @cached_property
    def velocity_scale(self) -> float:
        """Slope of integrated velocity on position that all joints share; NaN if they differ."""
        moving = [
            slope
            for (slope, likeness), moves in zip(self.velocities, self.excited, strict=True)
            if moves and likeness > ALIKE
        ]
        if len(moving) < min(2, sum(self.excited)) or not moving:
            return float("nan")
        middle = float(np.median(moving))
        alike = np.abs(np.array(moving) / middle - 1) < SHARED
        return middle if np.all(alike) else float("nan")

    @cached_property
    def excited(self) -> list[bool]:
        """Joints that move enough to be identified."""
        s = self.signals
        return [excited(s.q[:, k], s.dq[:, k], s.segments) for k in range(self.n_joints)]

    @cached_property
    def repeated(self) -> int:
        """Rows that repeat all positions of the previous row although joints move."""
        return int(repeated_rows(self.signals).sum())

    @cached_property
    def at_limit(self) -> list[float]:
        """Share of rows in which the torque of each joint stays at its extreme value."""
        columns = self.torque.T
        return [longest_plateau_share(column, self.signals.segments) for column in columns]

    @property
    def unrecorded(self) -> bool:
        """Whether no torque ever changes although the robot moves."""
        return not np.ptp(self.torque, axis=0).any() and any(self.excited)

    @cached_property
    def fits(self) -> Fits | None:
        """Averaged rows to which readings are fitted; None without a robot, or without torque."""
        from skidyn.measurement._rows import make_fits  # with it all columns of the evidence

        if self.robot is None or self.unrecorded:
            return None
        stuck = [*self.stuck.values(), *self.constant.values()]
        odd = [*self.odd_motion, *(run for runs in stuck for run in runs)]
        out = self.idle | self.lost_torque | np.isin(self.signals.trajectory, odd)
        if out.all():
            return None
        if not out.any():
            return make_fits(self.whole, self.filled, self.robot)
        return make_fits(self.whole.take(~out), self.filled[~out], self.robot)

    @cached_property
    def stuck(self) -> dict[int, list[int]]:
        """Recordings in which a position never changes although its velocity does, by joint."""
        from skidyn.measurement._odd_motion import stuck_positions

        return {} if len(self.leaps) or self.lost else stuck_positions(self.signals)

    @cached_property
    def constant(self) -> dict[int, list[int]]:
        """Few recordings in which a torque never changes although its joint moves, by joint."""
        if len(self.leaps) or self.lost:
            return {}
        parts = [(int(self.signals.trajectory[s.start]), s) for s in self.signals.segments]
        found = {}
        for k in range(self.n_joints):
            torque, q = self.torque[:, k], self.signals.q[:, k]
            span = MOVES * np.ptp(q)
            runs = [run for run, s in parts if np.ptp(torque[s]) == 0 and np.ptp(q[s]) > span > 0]
            if 0 < len(runs) < len(parts) / 2:
                found[k] = runs
        return found

    @cached_property
    def held(self) -> dict[int, float]:
        """Joints whose position holds its last value, from 0, and in what share of their rows."""
        s = self.signals
        steps = self.position_steps
        shares = {k: held_share(s.q[:, k], s.within, steps[k]) for k in range(self.n_joints)}
        free = [k for k, share in shares.items() if share < HELD_BY_ONE / 2 and self.excited[k]]
        # if all hold, rows repeat, or the sensors are coarse
        return {k: x for k, x in shares.items() if x > HELD_BY_ONE and self.excited[k] and free}

    @cached_property
    def velocity_steps(self) -> list[float]:
        """Steps of coarse velocities, rad/s or m/s, and NaN for others."""
        return [channel_step(dq) for dq in self.signals.dq.T]

    @cached_property
    def position_steps(self) -> list[float]:
        """Step of every position sensor, rad or m; NaN where it is not visible."""
        return [position_step(column) for column in self.signals.q.T]

    @property
    def coarse(self) -> bool:
        """Whether a turning joint has an encoder of 13 bits or fewer."""
        turning = np.flatnonzero(~self.signals.prismatic)
        return any(self.position_steps[k] > COARSE for k in turning)

    @cached_property
    def coarse_torques(self) -> dict[int, tuple[float, float]]:
        """Joints, from 0, with torque in coarse steps: the step, and its share of the spread."""
        found = {}
        for k, torque in enumerate(self.torque.T):
            step = channel_step(torque)
            share = step_share(torque, step)
            if share > NOTED_STEP:
                found[k] = (step, share)
        return found

    @cached_property
    def torque_scatter(self) -> float:
        """Largest scatter of a torque between samples, as a share of its spread; inf if none."""
        number, ratios = self.signals.trajectory, []
        within = number[4:] == number[:-4]
        for torque in self.torque.T if within.sum() >= ENOUGH else ():
            spread = float(np.median(np.abs(torque - np.median(torque))))
            bend = np.abs(np.diff(torque, n=4))[within]
            if spread > 0 and np.median(bend) > 0:
                ratios.append(float(np.median(bend)) / spread / np.sqrt(70))
        return max(ratios, default=np.inf)

    @cached_property
    def clipped(self) -> list[int]:
        """Joints whose torque lost one sign, from 0."""
        from skidyn.measurement._torque import cut_columns

        return cut_columns(self)

    @cached_property
    def overflowed(self) -> dict[int, int]:
        """Joints whose torque overflows, from 0, and how often it jumps."""
        from skidyn.measurement._overflow import overflowed_columns

        return overflowed_columns(self.signals, self.filled)

    @cached_property
    def idle(self) -> NDArray[np.bool_]:
        """Rows at the ends of recordings in which torque was not measured."""
        s = self.signals
        return idle_rows(s.q, s.dq, self.torque, s.clock, s.trajectory)

    @cached_property
    def lost_torque(self) -> NDArray[np.bool_]:
        """Rows inside recordings in which all torques keep their last values."""
        s = self.signals
        return lost_parts(s.q, self.torque, s.trajectory)

    @cached_property
    def missing(self) -> NDArray[np.bool_]:
        """Zeros in the place of missing torques, as a mask of rows and joints."""
        return missing_values(self.torque, self.idle)

    @cached_property
    def filled(self) -> Array:
        """Torque in which missing values are interpolated."""
        if not self.missing.any():
            return self.torque
        filled, rows = self.torque.astype(float), np.arange(self.n_samples)
        for k in np.flatnonzero(self.missing.any(axis=0)).tolist():
            lost = self.missing[:, k]
            filled[lost, k] = np.interp(rows[lost], rows[~lost], filled[~lost, k])
        return filled
