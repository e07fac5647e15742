# SPDX-License-Identifier: BSD-3-Clause
"""Intermittent torques: a push, a drag, a collision.

No function of the motion describes them, and they do not affect a robust measure of the residual.
An episode is a run of rows whose squared residual exceeds that of noise, in units of the noise of
the quiet rows, or of its own recording where this is larger; the run with the largest sum of the
excess is found first (the maximum-sum interval), then the next, until the sum is that of noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing

from skidyn._signals import Array
from skidyn.diagnosis._imitation import coarse_joints, imitate
from skidyn.diagnosis._noise import MEDIAN
from skidyn.diagnosis._rule import (
    EPISODE_EXCESS,
    EPISODE_FORCE_SHARE,
    EPISODE_LEAST_EXCESS,
    EPISODE_LEAST_SUM,
    EPISODE_MOST_ROWS,
    EPISODE_QUIET,
    EPISODE_SLIDING,
    IMITATED,
)
from skidyn.effects import Term
from skidyn.evidence import Fit, Problem


@dataclass(frozen=True)
class Episode:
    """A torque that acts only for some time.

    Parameters
    ----------
    trajectory : int
        Number of the recording.
    start, end : float
        Time in it, s.
    joints : tuple of int
        Joints on which it acts, counted from 1.
    size : tuple of float
        Root mean square of the torque on each of them, N m or N.
    link : str or None
        Link on which one force explains the torque of all joints.
    force : tuple of float or None
        This force on the robot in the base frame, mean over the episode, N.

    Examples
    --------
    >>> Episode(0, 2.0, 2.5, (3,), (1.2,), None, None).joints
    (3,)
    """

    trajectory: int
    start: float
    end: float
    joints: tuple[int, ...]
    size: tuple[float, ...]
    link: str | None
    force: tuple[float, ...] | None

    def to_dict(self) -> dict[str, Any]:
        """As in the report file.

        Returns
        -------
        dict
            JSON types only.
        """
        return {
            "trajectory": self.trajectory,
            "start": self.start,
            "end": self.end,
            "joints": list(self.joints),
            "size": list(self.size),
            "link": self.link,
            "force": None if self.force is None else list(self.force),
        }


def find_episodes(
    problem: Problem,
    residual: Sequence[Array],
    least: Array,
    share: Array,
    loud: Mapping[int, Array],
) -> tuple[list[Episode], list[NDArray[np.bool_]]]:
    """Episodes in the residual of a model.

    Parameters
    ----------
    problem : Problem
        Rows.
    residual : sequence of ndarray of shape (n_rows_j,)
        Residual rows of every joint of the completed model, N m or N.
    least : ndarray of shape (n_joints,)
        Torque that an episode must reach, N m or N.
    share : ndarray of shape (n_joints,)
        Share of the squared residual that the episodes of a joint must contain.
    loud : mapping of int to ndarray of shape (n_joints,)
        Noise of every recording, in units of that of the typical one
        (:func:`~skidyn.diagnosis._noise.noise_of_recordings`).

    Returns
    -------
    episodes : list of Episode
        In the order of trajectories and time; overlapping ones of several joints are merged.
    inside : list of ndarray of shape (n_rows_j,) of bool
        Rows of every joint in one of its episodes.
    """
    spans: list[tuple[int, float, float, int]] = []
    inside = []
    for j, r in enumerate(residual):
        chosen = _rows_of_episodes(problem, j, r, float(least[j]), float(share[j]), loud)
        inside.append(chosen)
        spans += [(k, a, b, j) for k, a, b in _spans(problem, j, chosen)]
    episodes = []
    for trajectory, start, end, joints in _overlapping(spans):
        size = tuple(_size(problem, j, residual[j], trajectory, start, end) for j in joints)
        link, force = _force(problem, residual, trajectory, start, end, joints)
        numbers = tuple(j + 1 for j in joints)
        episodes.append(Episode(trajectory, start, end, numbers, size, link, force))
    return episodes, inside


def not_of_positions(
    problem: Problem, fit: Fit, residual: Sequence[Array], inside: Sequence[NDArray[np.bool_]]
) -> NDArray[np.bool_]:
    """Whether the episodes of each joint are not what noise of its positions causes, (n_joints,).

    Coarse positions make bursts in the acceleration of a slow motion. With an imitation of the
    noise, as many rows with the largest residuals may hold only a part of what the episodes do.

    Parameters
    ----------
    problem : Problem
        Rows and logged positions.
    fit : Fit
        The completed model, of whose residual the episodes are.
    residual, inside : sequence of ndarray
        As :func:`find_episodes` takes and returns them.
    """
    real = np.ones(problem.n_joints, dtype=bool)
    held = coarse_joints(problem, fit, problem.torque - problem.explained(fit))
    held &= {j for j, rows in enumerate(inside) if rows.any()}
    if not held:
        return real
    imitated = imitate(problem, fit)
    noise = imitated.fit(imitated.terms).residual
    for j in held:
        largest = np.sort(noise[j] ** 2)[-int(inside[j].sum()) :]
        real[j] = np.sum(largest) <= IMITATED * np.sum(residual[j][inside[j]] ** 2)
    return real


def acting(
    problem: Problem, term: Term, torque: Mapping[Term, Mapping[int, Array]]
) -> list[Episode]:
    """Intervals of an effect that begins or ends within recordings.

    Parameters
    ----------
    problem : Problem
        Rows.
    term : Term
        The effect.
    torque : mapping of Term to mapping of int to ndarray of shape (n_samples,)
        Torque of every effect at every sample, by joint, N m or N.
    """
    signals, episodes = problem.signals, []
    for name, start, end in term.spans:
        inside = (signals.trajectory == name) & (signals.clock >= start) & (signals.clock <= end)
        own = {j: float(np.sqrt(np.mean(x[inside] ** 2))) for j, x in torque[term].items()}
        joints, size = tuple(j + 1 for j in own), tuple(own.values())
        time = signals.clock[inside]
        episodes.append(
            Episode(name, float(time.min()), float(time.max()), joints, size, None, None)
        )
    return episodes


def away_from_reversals(
    problem: Problem, residual: Sequence[Array], sliding: NDArray[np.bool_]
) -> list[Array]:
    """Residual rows, 0 for a row with samples close to rest and reversals.

    Parameters
    ----------
    problem : Problem
        Rows, which may reach up to the reversals.
    residual : sequence of ndarray of shape (n_rows_j,)
        Of every joint.
    sliding : ndarray of shape (n_samples, n_joints) of bool
        Samples away from rest and reversals.

    Returns
    -------
    list of ndarray of shape (n_rows_j,)
    """
    ones = np.ones(problem.signals.n_samples)
    kept = []
    for j, r in enumerate(residual):
        share = problem.rows.average(sliding[:, j].astype(float), j) / problem.rows.average(ones, j)
        kept.append(np.where(share >= EPISODE_SLIDING, r, 0.0))
    return kept


def _rows_of_episodes(
    problem: Problem,
    joint: int,
    residual: Array,
    least: float,
    share: float,
    loud: Mapping[int, Array],
) -> NDArray[np.bool_]:
    """Rows of a joint in its episodes; none if they are too many for an intermittent torque."""
    chosen = np.zeros(len(residual), dtype=bool)
    if len(residual) < 40:
        return chosen
    quiet = float(np.median(np.abs(residual))) / MEDIAN
    if quiet <= 0:
        return chosen
    noise = quiet * np.array([loud[k][joint] for k in problem.rows.trajectory[joint].tolist()])
    excess = (residual / noise) ** 2 - EPISODE_EXCESS
    weight = problem.rows.average(np.ones(problem.signals.n_samples), joint)
    for order in _runs(problem, joint):
        _take(excess[order], order, chosen)
    # A row is the torque times its weight.
    large = np.abs(residual[chosen] / weight[chosen])
    if not len(large) or np.quantile(large, 0.9) < least:
        return np.zeros_like(chosen)
    total = float(np.maximum(excess, 0.0).sum())
    held = float(np.maximum(excess[chosen], 0.0).sum())
    fits = chosen.mean() <= EPISODE_MOST_ROWS and held >= EPISODE_LEAST_EXCESS * total
    fits &= float(np.sum(residual[chosen] ** 2)) >= share * float(np.sum(residual**2))
    return chosen if fits else np.zeros_like(chosen)


def _runs(problem: Problem, joint: int) -> list[NDArray[np.int64]]:
    """Rows of a joint, trajectory by trajectory, in the order of time."""
    trajectory, time = problem.rows.trajectory[joint], problem.rows.time[joint]
    order = np.lexsort((time, trajectory))
    return np.split(order, np.flatnonzero(np.diff(trajectory[order])) + 1)


def _take(excess: Array, order: NDArray[np.int64], chosen: NDArray[np.bool_]) -> None:
    """Mark the intervals of largest sum, one after another."""
    left = excess.copy()
    while len(left):
        total = np.concatenate([[0.0], np.cumsum(left)])
        lowest = np.minimum.accumulate(total)
        end = int(np.argmax(total - lowest))
        if total[end] - lowest[end] < EPISODE_LEAST_SUM:
            return
        start = int(np.argmin(total[: end + 1]))
        # A quiet interval between two pushes belongs to neither.
        inside = binary_closing(np.pad(left[start:end] > 0, EPISODE_QUIET), np.ones(EPISODE_QUIET))
        chosen[order[start:end]] = inside[EPISODE_QUIET:-EPISODE_QUIET]
        left[start:end] = -EPISODE_EXCESS


def _spans(
    problem: Problem, joint: int, chosen: NDArray[np.bool_]
) -> list[tuple[int, float, float]]:
    """Trajectory, start and end of the runs of chosen rows."""
    spans = []
    for order in _runs(problem, joint):
        marked = np.concatenate([[False], chosen[order], [False]])
        edges = np.flatnonzero(np.diff(marked.astype(int)))
        time = problem.rows.time[joint][order]
        name = int(problem.rows.trajectory[joint][order[0]]) if len(order) else 0
        spans += [
            (name, float(time[a]), float(time[b - 1]))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        ]
    return spans


def _overlapping(
    spans: list[tuple[int, float, float, int]],
) -> list[tuple[int, float, float, list[int]]]:
    """Overlapping spans of several joints, merged."""
    merged: list[tuple[int, float, float, list[int]]] = []
    for k, start, end, j in sorted(spans):
        if merged and merged[-1][0] == k and start <= merged[-1][2] + 0.1:
            _, first, last, joints = merged[-1]
            merged[-1] = (k, first, max(last, end), sorted({*joints, j}))
        else:
            merged.append((k, start, end, [j]))
    return merged


def _between(
    problem: Problem, j: int, trajectory: int, start: float, end: float
) -> NDArray[np.int64]:
    time = problem.rows.time[j]
    here = (problem.rows.trajectory[j] == trajectory) & (time >= start) & (time <= end)
    return np.flatnonzero(here)


def _size(
    problem: Problem, j: int, residual: Array, trajectory: int, start: float, end: float
) -> float:
    """Root mean square of the torque in an episode, N m or N."""
    here = _between(problem, j, trajectory, start, end)
    weight = problem.rows.average(np.ones(problem.signals.n_samples), j)[here]
    return float(np.sqrt(np.mean((residual[here] / weight) ** 2))) if len(here) else 0.0


def _force(
    problem: Problem,
    residual: Sequence[Array],
    trajectory: int,
    start: float,
    end: float,
    joints: Sequence[int],
) -> tuple[str | None, tuple[float, ...] | None]:
    """The link and the mean force on it that explain the torque of all joints, if one does.

    One force in each of three parts of the episode, on the origin of the frame of one link; of
    equally good links the outermost one is reported.
    """
    robot = problem.robot
    if robot is None or len(joints) < 2:
        return None, None
    s = problem.signals
    samples = (s.trajectory == trajectory) & (s.clock >= start) & (s.clock <= end)
    if samples.sum() < 6:
        return None, None
    rows = [_between(problem, j, trajectory, start, end) for j in range(problem.n_joints)]
    best: tuple[float, str | None, tuple[float, ...] | None] = (EPISODE_FORCE_SHARE, None, None)
    total = sum(float(residual[j][rows[j]] @ residual[j][rows[j]]) for j in range(problem.n_joints))
    third = np.minimum((s.clock - start) / max(end - start, 1e-9) * 3, 2.999).astype(int)
    for name in robot.body_names[max(joints) :]:
        jacobian = np.zeros((s.n_samples, 3, problem.n_joints))
        jacobian[samples] = robot.jacobian(s.q[samples], name)[:, :3]
        columns, target = [], []
        for j in range(problem.n_joints):
            spread = np.column_stack(
                [-jacobian[:, :, j] * (samples & (third == part))[:, None] for part in range(3)]
            )
            columns.append(problem.rows.average(spread, j)[rows[j]])
            target.append(residual[j][rows[j]])
        a, y = np.vstack(columns), np.concatenate(target)
        if len(y) < 3 * a.shape[1]:
            continue
        solution = np.linalg.lstsq(a, y, rcond=1e-8)[0]
        share = 1 - float(np.sum((y - a @ solution) ** 2)) / max(total, 1e-300)
        if share >= best[0]:
            best = (share, name, tuple(map(float, solution.reshape(3, 3).mean(0))))
    return best[1], best[2]
