# SPDX-License-Identifier: BSD-3-Clause
"""Averaged rows of a measurement, and fits of a robot to them in different readings.

The torque of each joint is fitted as a multiple of the robot's own torque and its friction, rotor
inertia and offset, all but the offset not negative: a negative friction would feed energy. Rows
that no reading explains have a low weight, because residuals have Student's t distribution. Fits
with identified bodies are a second test, which does not confirm a reading that is supported only by
wrong masses of the description.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._signals import Array, Signals
from skidyn.effects import hats
from skidyn.measurement._loads import LOAD, by_recording, n_loads, span
from skidyn.measurement._outcome import Outcome
from skidyn.measurement._reading import Reading
from skidyn.measurement._results import Results
from skidyn.measurement._robust import (
    FEWEST,
    ROUNDS,
    RobustFit,
    fit_admissible,
    fit_at_once,
    fit_together,
)
from skidyn.robots import Robot, base_parameter_index, with_whole_turns

#: Nodes of a function of the position.
PLACES = 8
#: Samples in a row, and two of them whose mean is about that of all.
SAMPLES, FEW_SAMPLES = 6, (1, 4)
#: Columns of a joint in addition to those of the bodies: friction, rotor inertia and a constant.
OWN = 4
#: Log-likelihood that every coefficient of a load must gain on average: half the logarithm of some
#: 150 rows, twice.
LOADED = 5.0
#: Rows of a first test at least, and at most over the number of joints.
FEWEST_ROWS, MOST_ROWS = 150, 2800
#: Number of motions whose columns are cached, since readings are tried one after another.
KEPT = 2


@dataclass(frozen=True)
class Recorded:
    """Torque at the full rate, averaged over as many samples as rows skip, and its clock."""

    clock: Array
    torque: Array
    segments: Sequence[slice]
    picked: NDArray[np.int64]


@dataclass
class Fits:
    """Samples in rows of equal length, and the fits of readings to them.

    Attributes
    ----------
    robot : Robot
        As described.
    signals : Signals
        Smoothed motion, ``SAMPLES`` samples a row.
    torque : ndarray of shape (n_samples, n_joints)
        Torque averaged alike.
    moving : ndarray of shape (n_rows, n_joints) of bool
        Rows in which the joint of a column moves: at rest friction has no direction.
    recorded : Recorded
        Torque at the full rate, for rows at other times.
    left_out : frozenset of int
        Columns of the torque, from 0, that are not used.
    backend : {"numpy", "once"}, default="numpy"
        Method to compute torques; for a robot that is only tried, generating a program is not worth
        its time.
    loads : bool, default=False
        Whether identified bodies include a load that differs from recording to recording.
    """

    robot: Robot
    signals: Signals
    torque: Array
    moving: NDArray[np.bool_]
    recorded: Recorded
    left_out: frozenset[int] = frozenset()
    backend: str = "numpy"
    loads: bool = False
    _of_motion: Results = field(default_factory=Results, repr=False)
    _of_torque: Results = field(default_factory=Results, repr=False)

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return self.signals.n_joints

    def without(self, joints: Sequence[int]) -> Fits:
        """The same rows without the torque of some joints."""
        left_out = self.left_out | frozenset(joints)
        if left_out == self.left_out:
            return self  # with all that was fitted so far
        return self._of_torque.get("fewer", left_out, lambda: self._anew(left_out=left_out))

    def of(self, robot: Robot) -> Fits:
        """The same rows, for another robot with the same joints, which is only tried."""
        return self._anew(robot=robot, backend="once")

    def thinned(self, count: int) -> Fits:
        """Some of the rows, evenly over the log, for a first test."""
        step = self.n_rows // count
        if step < 2:
            return self
        return self.only(np.arange(self.n_rows) % step == 0)

    @property
    def few(self) -> Fits:
        """Few of the rows, for a first test, of which a robot with more joints needs fewer."""
        return self.thinned(max(FEWEST_ROWS, MOST_ROWS // self.n_joints))

    def _anew(self, **changes: Any) -> Fits:
        """Changed rows, of which nothing has been fitted."""
        kept = {f.name: getattr(self, f.name) for f in fields(self) if not f.name.startswith("_")}
        return Fits(**{**kept, **changes})

    def loaded(self, reading: Reading | None = None) -> Fits:
        """The same rows, with loads where these explain far more than chance in a reading.

        A load of a recording, as of a workpiece, is larger than most mistakes; identified bodies
        that are common to all recordings would leave it as a residual in which they are lost.
        """
        count = n_loads(self.signals.trajectory)
        if self.loads or not count:
            return self
        read = reading or Reading()

        def loaded() -> Fits:
            other = self.with_loads()
            gain = other.identified(read).gained_over(self.identified(read))
            return other if gain > LOADED * count else self

        return self._of_torque.get("loaded", read, loaded)

    def with_loads(self, loads: bool = True) -> Fits:
        """The same rows, with loads in any case, or without."""
        return self if self.loads == loads else self._anew(loads=loads)

    def with_torque(self, torque: Array) -> Fits:
        """The same rows with another torque, (n_samples, n_joints); what motion implies is kept."""
        return replace(self, torque=torque, _of_torque=Results())

    def with_motion(self, signals: Signals) -> Fits:
        """The same rows and torque with another motion."""
        return self._anew(signals=signals)

    def scaled(self, gains: Mapping[int, float]) -> Fits:
        """The same rows with columns of the torque divided by gains."""
        torque = self.torque.copy()
        for column, gain in gains.items():
            torque[:, column] /= gain
        return self.with_torque(torque)

    def with_gravity(self, reading: Reading) -> Fits:
        """The same rows with the gravity torque of the stated bodies added."""
        pull = self.robot.gravity_torque(reading.motion(self.signals).q)
        torque = self.torque.copy()
        for joint in range(self.n_joints):
            column, sign = reading.torque_column(joint)
            torque[:, column] += sign * pull[:, joint]
        return self.with_torque(torque)

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return len(self.moving)

    @property
    def recording(self) -> NDArray[np.int64]:
        """Number of the recording of every row."""
        return self.signals.trajectory[::SAMPLES]

    @property
    def carrying(self) -> NDArray[np.int64]:
        """The same as far as identified bodies include loads that differ between recordings."""
        return self.recording if self.loads else np.zeros_like(self.recording)

    def average(self, values: Array) -> Array:
        """Mean of every row, from values at every sample."""
        rows = values.reshape(-1, SAMPLES, *values.shape[1:])
        total = rows[:, 0].astype(float)  # numpy's mean takes several times as long
        for k in range(1, SAMPLES):
            total += rows[:, k]
        return np.asarray(total / SAMPLES)

    def torque_at(self, lag: float | Array) -> Array:
        """Torque that was recorded a lag (s) after the motion of every sample, or lags of them."""
        source = self.recorded
        later = np.empty((len(source.picked), self.n_joints))
        lags = np.broadcast_to(lag, len(later))
        for rows in source.segments:
            own = (source.picked >= rows.start) & (source.picked < rows.stop)
            at = source.clock[source.picked[own]] + lags[own]
            clock = source.clock[rows]
            for k in range(self.n_joints):
                later[own, k] = np.interp(at, clock, source.torque[rows, k])
        return later

    def mean_torque(self, column: int) -> tuple[Array, NDArray[np.bool_]]:
        """Torque of a column in rows, and which rows count."""
        return self._mean_torque[:, column], self.moving[:, column]

    @cached_property
    def _mean_torque(self) -> Array:
        return self.average(self.torque)

    def usable(self, column: int, fewest: int = FEWEST) -> bool:
        """Whether the torque of a column is used, and its joint moves."""
        return column not in self.left_out and int(self.moving[:, column].sum()) >= fewest

    def nominal(self, reading: Reading, rounds: int = ROUNDS) -> Outcome:
        """Fit with the bodies of the robot's description."""
        read = [(j, *reading.torque_column(j)) for j in range(self.n_joints)]
        read = [key for key in read if self.usable(key[1])]
        fits = self._joint_fits(reading.of_motion, read, rounds)
        columns = [column for _, column, _ in read]
        outcome = Outcome.of(self.n_joints, columns, fits)
        outcome.gain[columns] = [fit.coefficients[0] for fit in fits]
        return outcome

    def _joint_fits(
        self, motion: Reading, read: Sequence[tuple[int, int, float]], rounds: int
    ) -> list[RobustFit]:
        """Fits of joints to columns of the torque; readings share most of these fits."""
        known: dict[tuple[int, int, float], RobustFit]
        known = self._of_torque.get("joints", (motion, rounds), dict)
        new = [key for key in read if key not in known]
        if new:
            joints, columns, signs = (np.array(x) for x in zip(*new, strict=True))
            own = self.columns(motion)[:, :, joints].transpose(2, 0, 1)
            y, use = (signs * self._mean_torque[:, columns]).T, self.moving[:, columns].T
            if self.loads:
                own, y = self._beside_loads(motion, joints, own, y, use, rounds)
            found = (
                fit_at_once(own, y, use)
                if rounds == 1
                else [
                    fit_admissible(a[w], t[w], rounds) for a, t, w in zip(own, y, use, strict=True)
                ]
            )
            known.update(zip(new, found, strict=True))
        return [known[key] for key in read]

    def _beside_loads(
        self,
        motion: Reading,
        joints: NDArray[np.int64],
        own: Array,
        y: Array,
        use: NDArray[np.bool_],
        rounds: int,
    ) -> tuple[Array, Array]:
        """Columns and torques of joints without what a load of single recordings follows of them.

        Stated bodies have no common fit of all joints, so each of these has a load of its own. A
        single round only selects readings, for which two samples of a row are enough.
        """
        samples = FEW_SAMPLES if rounds == 1 else range(SAMPLES)

        def columns_of_loads() -> Array:
            robot, s = self._robot(motion), motion.motion(self.signals)
            felt = self.mean_regressor(robot, s, 10 * robot.n_bodies + LOAD, samples)
            every = by_recording(felt.reshape(self.n_rows, -1), self.recording)
            return every.reshape(self.n_rows, -1, *felt.shape[1:])

        carried = self._of_motion.get("loads", (motion, len(samples)), columns_of_loads, KEPT)
        own, y = own.copy(), y.copy()
        for i, j in enumerate(joints.tolist()):
            load = carried[use[i], :, j].reshape(int(use[i].sum()), -1)
            basis = span(np.column_stack([load, np.ones(len(load))]))
            for values in (own[i], y[i]):
                values[use[i]] -= basis @ (basis.T @ values[use[i]])
        return own, y

    def offsets(self, reading: Reading) -> Array:
        """Median difference of every joint from the stated bodies, (n_joints,), N m or N.

        It is 0 of a joint that is not fitted. Of a slider, the fit does not separate the mass from
        the inertia of its rotor.
        """
        there, own = self.nominal(reading), self.columns(reading.of_motion)[:, 0]
        found = np.zeros(self.n_joints)
        for j in range(self.n_joints):
            column, sign = reading.torque_column(j)
            if column in there.fits:
                left = (sign * self._mean_torque[:, column] - own[:, j])[self.moving[:, column]]
                found[j] = np.median(left)
        return found

    def offset(self, reading: Reading) -> float:
        """Largest of the :meth:`offsets` without sign, in units of the scale of the residual."""
        there, found = self.nominal(reading), np.abs(self.offsets(reading))
        columns = [reading.torque_column(j)[0] for j in range(self.n_joints)]
        scaled = [
            x / there.fits[c].scale for x, c in zip(found, columns, strict=True) if c in there.fits
        ]
        return float(max(scaled, default=0.0))

    def coefficients(self, joint: int) -> Array:
        """Of a joint read as it is: multiple of its own torque, viscous, dry, rotor inertia."""
        return self._joint_fits(Reading(), [(joint, joint, 1.0)], ROUNDS)[0].coefficients

    def columns(self, motion: Reading) -> Array:
        """Mean columns of every joint, shape (n_rows, 4, n_joints)."""

        def columns() -> Array:
            s = motion.motion(self.signals)
            return np.stack([self._own_torque(motion, s), *self._friction(motion, s)], axis=1)

        return self._of_motion.get("columns", motion, columns, KEPT)

    def _friction(self, motion: Reading, s: Signals) -> list[Array]:
        """Mean columns of friction and rotor inertia, which no zero and no gravity changes.

        Nor does a rate: slower motion would only blur the sign of friction. Reversed time turns it.
        """
        s = self._unstretched(motion, s)
        direction = math.copysign(1.0, motion.stretch)
        motion = replace(motion, zero=(), gravity=None, stretch=direction)
        return self._of_motion.get(
            "friction", motion, lambda: [self.average(x) for x in (s.dq, s.sign, s.ddq)], KEPT
        )

    def _unstretched(self, motion: Reading, s: Signals) -> Signals:
        """Motion of a reading without its other rate, which is that of friction in any case."""
        direction = math.copysign(1.0, motion.stretch)
        if motion.stretch == direction:
            return s
        return replace(motion, stretch=direction).motion(self.signals)

    def _own_torque(self, motion: Reading, s: Signals) -> Array:
        """Mean torque of the robot as described, in rows."""
        if motion.gravity is None:
            torque = self.robot.inverse_dynamics(s.q, s.dq, s.ddq, backend=self.backend)
            return self.average(torque)
        still, pulls = self.gravity_parts(motion)
        return np.asarray(still + np.tensordot(motion.gravity, pulls, 1))

    def gravity_parts(self, motion: Reading) -> tuple[Array, Array]:
        """Mean torque of the robot without gravity, and that of a unit of gravity along each axis.

        Torque is linear in gravity, in which many readings of one motion differ.

        Parameters
        ----------
        motion : Reading
            Its gravity does not count.

        Returns
        -------
        still : ndarray of shape (n_rows, n_joints)
        pulls : ndarray of shape (3, n_rows, n_joints)
        """
        motion = replace(motion.of_motion, gravity=None)

        def parts() -> tuple[Array, Array]:
            s = motion.motion(self.signals)
            robot, none = self.robot, (0.0, 0.0, 0.0)
            still = robot.inverse_dynamics(s.q, s.dq, s.ddq, gravity=none, backend="once")
            axes = map(tuple, np.eye(3))
            pulls = [robot.gravity_torque(s.q, gravity=axis, backend="once") for axis in axes]
            return self.average(still), np.array([self.average(pull) for pull in pulls])

        return self._of_motion.get("gravity", motion, parts, 1)

    def read_columns(self) -> tuple[Array, Array, Array, Array]:
        """Mean torques of gravity and of the rest of the stated bodies, velocity and its sign.

        As recorded; of shape (n_rows, n_joints) each.
        """
        still, pulls = self.gravity_parts(Reading())
        _, speed, sign, _ = self.columns(Reading()).transpose(1, 0, 2)
        return np.tensordot(self.robot.gravity, pulls, 1), still, speed, sign

    def identified(self, reading: Reading) -> Outcome:
        """Fit with identified bodies, common to all joints."""

        def outcome() -> Outcome:
            columns, designs, places, targets = self._designs(reading)
            return Outcome.of(self.n_joints, columns, fit_together(designs, places, targets))

        return self._of_torque.get("identified", reading, outcome)

    def with_a_spring(self, joint: int) -> Outcome:
        """Fit with identified bodies and any slow function of one position on its joint, as it is.

        Parameters
        ----------
        joint : int
            Joint, from 0.
        """

        def outcome() -> Outcome:
            joints, designs, places, targets = self._designs(Reading())
            at, use = joints.index(joint), self.moving[:, joint]
            lines = self.average(lines_between(self.signals.q[:, joint]))[use]
            new = 1 + max(int(place.max()) for place in places) + np.arange(lines.shape[1])
            designs[at] = np.hstack([designs[at], lines])
            places[at] = np.append(places[at], new)
            return Outcome.of(self.n_joints, joints, fit_together(designs, places, targets))

        return self._of_torque.get("spring", joint, outcome, self.n_joints)

    def predicted_without(
        self, parts: Iterable[NDArray[np.bool_]]
    ) -> Iterator[dict[int, tuple[Array, float]]]:
        """Predictions for some rows by bodies identified without them.

        Parameters
        ----------
        parts : iterable of ndarray of shape (n_rows,) of bool
            Rows that are left out, one part after the other.

        Yields
        ------
        dict of int to (ndarray, float)
            By joint: prediction of the rows left out in which it moves, and scale of the residual
            of the others.
        """
        joints, designs, places, targets = self._designs(Reading())
        for rows in parts:
            out = [rows[self.moving[:, k]] for k in joints]
            kept = [(d[~o], y[~o]) for d, y, o in zip(designs, targets, out, strict=True)]
            if any(len(y) < FEWEST for _, y in kept):
                yield {}
                continue
            fits = fit_together([d for d, _ in kept], places, [y for _, y in kept])
            yield {
                k: (d[o] @ fit.coefficients, fit.scale)
                for k, d, o, fit in zip(joints, designs, out, fits, strict=True)
            }

    def only(self, rows: NDArray[np.bool_]) -> Fits:
        """Some of the rows."""
        samples = np.repeat(rows, SAMPLES)
        return self._anew(
            signals=self.signals.take(samples),
            torque=self.torque[samples],
            moving=self.moving[rows],
            recorded=replace(self.recorded, picked=self.recorded.picked[samples]),
        )

    def bodies(self) -> tuple[Array, dict[int, float]]:
        """Identified coefficients of the unchanged log, and scale of the residual by joint."""
        joints, designs, places, targets = self._designs(Reading())
        fits = fit_together(designs, places, targets)
        found = np.zeros(1 + max((int(place.max()) for place in places), default=0))
        for place, fit in zip(places, fits, strict=True):
            found[place] = fit.coefficients
        return found, {k: fit.scale for k, fit in zip(joints, fits, strict=True)}

    def residuals(self, bodies: Array, reading: Reading) -> dict[int, Array]:
        """Residual torque of identified coefficients for every joint, in some reading."""
        robot, s = self._robot(reading), reading.motion(self.signals)
        base = base_parameter_index(robot)
        parameters, own = np.zeros((robot.n_bodies, 10)), np.zeros((self.n_joints, OWN))
        parameters.flat[base] = bodies[: len(base)]
        own.flat[: len(bodies) - len(base)] = bodies[len(base) :]
        # Torque itself, not the columns of all bodies, of which these coefficients are the sum.
        rigid = self.average(robot.inverse_dynamics(s.q, s.dq, s.ddq, parameters=parameters))
        left = {}
        for j, (column, sign) in enumerate(reading.torque_column(j) for j in range(len(own))):
            if self.usable(column, 1):
                y, use = self.mean_torque(column)
                predicted = rigid[:, j] + self._own_columns(reading, s, j) @ own[j]
                left[column] = sign * y[use] - predicted[use]
        return left

    def _robot(self, reading: Reading) -> Robot:
        """The robot, with the gravity of a reading."""
        if reading.gravity is None:
            return self.robot
        return replace(self.robot, gravity=np.asarray(reading.gravity))

    def _own_columns(self, motion: Reading, s: Signals, joint: int) -> Array:
        """Mean columns of a joint in addition to those of the bodies, shape (n_rows, OWN)."""
        rubs = [column[:, joint] for column in self._friction(motion, s)]
        return np.column_stack([*rubs, np.ones(self.n_rows)])

    def _designs(
        self, reading: Reading
    ) -> tuple[list[int], list[Array], list[NDArray[np.int64]], list[Array]]:
        """Columns of the torque, and designs, places of coefficients and targets of their fit."""
        felt = self._felt_columns(reading.of_motion)
        read = [reading.torque_column(j) for j in range(self.n_joints)]
        joints = [j for j, (column, _) in enumerate(read) if self.usable(column)]
        designs, places, targets = [], [], []
        for j in joints:
            y, use = self.mean_torque(read[j][0])
            columns, place = felt[j]
            designs.append(columns[use])
            places.append(place)
            targets.append(read[j][1] * y[use])
        return [read[j][0] for j in joints], designs, places, targets

    def felt(self, joint: int) -> tuple[Array, NDArray[np.int64]]:
        """Mean columns of what a joint feels of bodies that are identified, and their places."""
        return self._felt_columns(Reading())[joint]

    def _felt_columns(self, motion: Reading) -> list[tuple[Array, NDArray[np.int64]]]:
        """Mean columns that act on every joint, and the indices of their coefficients.

        Those of the last motion are cached, since readings of the torque share them.
        """

        def found() -> Iterator[tuple[Array, NDArray[np.int64]]]:
            robot, s = self._robot(motion), motion.motion(self.signals)
            n_base = len(base_parameter_index(robot))
            first = n_base + OWN * self.n_joints
            for j, (bodies, felt, carried) in enumerate(self.felt_bodies(robot, s)):
                columns = np.hstack([bodies, self._own_columns(motion, s, j)])
                place = np.append(felt, n_base + OWN * j + np.arange(OWN))
                if carried.any():
                    columns = np.hstack([columns, carried])
                    place = np.append(place, first + np.arange(carried.shape[1]))
                yield columns, place

        return self._of_motion.get("felt", motion, lambda: list(found()), 1)

    def felt_bodies(
        self, robot: Robot, s: Signals
    ) -> Iterator[tuple[Array, NDArray[np.int64], Array]]:
        """Mean columns of the bodies that every joint feels, and of their loads.

        Parameters
        ----------
        robot : Robot
            The robot.
        s : Signals
            Its motion, ``SAMPLES`` samples a row.

        Yields
        ------
        bodies : ndarray of shape (n_rows, n_felt)
            Columns of base parameters, without those that the joint does not feel.
        felt : ndarray of shape (n_felt,)
            Numbers of these parameters.
        loads : ndarray of shape (n_rows, n_loads)
            Columns of the loads of recordings; none unless they are identified.
        """
        base = base_parameter_index(robot)
        last = 10 * robot.n_bodies + LOAD if self.loads else LOAD[:0]
        regressor = self.mean_regressor(robot, s, np.append(base, last))
        for of_joint in regressor.transpose(1, 0, 2):
            bodies, load = np.split(of_joint, [len(base)], axis=1)
            felt = np.flatnonzero(bodies.any(axis=0))
            yield bodies[:, felt], felt, by_recording(load, self.carrying)

    def mean_regressor(
        self,
        robot: Robot,
        s: Signals,
        index: NDArray[np.int64],
        samples: Sequence[int] = range(SAMPLES),
    ) -> Array:
        """Some columns of the mean regressor, (n_rows, n_joints, len(index)), chunk by chunk."""
        total = np.zeros((robot.n_joints, len(index), self.n_rows))
        robot = with_whole_turns(robot)
        for k in samples:  # the first samples of all rows, then the second ones
            q, dq, ddq = (x[k::SAMPLES] for x in (s.q, s.dq, s.ddq))
            for rows, regressor in robot.iter_torque_regressor(q, dq, ddq):
                total[:, :, rows] += regressor[:, index]
        return np.moveaxis(total / len(samples), 2, 0)


def friction(signals: Signals, joint: int) -> Array:
    """Columns of viscous and dry friction and of rotor inertia of a joint."""
    return np.column_stack([s[:, joint] for s in (signals.dq, signals.sign, signals.ddq)])


def lines_between(position: Array) -> Array:
    """Columns of any slow function of a position, as of a spring that is missing.

    These are broken lines between a few quantiles; as many nodes as for a constant each could
    follow slow noise.

    Parameters
    ----------
    position : ndarray of shape (n_rows,), rad or m
        Position of a joint.

    Returns
    -------
    ndarray of shape (n_rows, at most 8)
        They sum to 1.
    """
    nodes = np.unique(np.quantile(position, np.linspace(0, 1, PLACES)))
    return hats(position, nodes)
