# SPDX-License-Identifier: BSD-3-Clause
"""Where a model fails: joints, and parts of their motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from skidyn._signals import Array
from skidyn._text import digits, listed, span_told, times, trajectories_told
from skidyn.diagnosis._comparison import Comparison, regimes

#: A joint fails where its error on judged rows exceeds the noise by this factor: logs without an
#: effect stay below it (benchmarks/diagnosis/nothing_hidden.py).
FAILS = 1.5
#: Noise below this share of the measured torque is due to rounding.
ROUNDING = 1e-9
#: A place is reported if it contains this share of the excess, with odds this many times those of a
#: sample.
SHARE, ODDS = 0.4, 2.5
#: An interval of time is more informative than a regime only if it is much shorter.
TIME_SHARE, TIME_ODDS = 0.5, 6.0
#: An interval of time is reported in addition to its trajectories if it is at most this share of
#: their time.
NARROWER = 0.5
#: Ranges of position and intervals of time consist of this many equal parts.
POSITIONS, TIMES = 24, 80
#: Least number and share of samples at rest for the error at rest to be reported.
FEWEST, SHORTEST = 20, 0.01

_WHERE = {
    "reversal": "around its reversals",
    "slow": "at low speed",
    "medium": "at medium speed",
    "fast": "at high speed",
    "loaded": "under high load",
    "warm": "when it is warm or late in the recording",
}


@dataclass(frozen=True)
class Place:
    """A part of the motion in which the share of the excess error exceeds the share of time.

    Parameters
    ----------
    kind : {"regime", "position", "trajectory", "time"}
        Kind of the place.
    where : str
        Text of the place, such as ``"at low speed"``.
    share_of_excess : float
        Share of the squared error of the joint above the noise.
    share_of_time : float
        Share of the judged samples.
    regime : str, default=""
        Name of the regime, of places of that kind.
    low, high : float, optional
        Ends of a range of the joint's position (rad or m), or of time since the beginning of the
        trajectory (s).
    trajectories : tuple of int, default=()
        Trajectories, of places of the kinds ``"trajectory"`` and ``"time"``.

    Examples
    --------
    >>> place = Place("regime", "at low speed", 0.8, 0.2, regime="slow")
    >>> place.share_of_excess
    0.8
    """

    kind: str
    where: str
    share_of_excess: float
    share_of_time: float
    regime: str = ""
    low: float | None = None
    high: float | None = None
    trajectories: tuple[int, ...] = ()


@dataclass(frozen=True)
class Failure:
    """A joint whose error is larger than the noise, and the places of the excess.

    Parameters
    ----------
    joint : int
        Joint, counted from 1.
    name : str
        Its name.
    rmse : float
        Held-out root mean square error on judged samples, N m or N.
    noise : float
        Noise of the joint, N m or N.
    ratio : float
        Error over noise.
    places : tuple of Place
        Regimes, range of position, trajectories and interval of time in which the excess occurs;
        empty if it is spread evenly.
    sentence : str
        The same in words.

    Examples
    --------
    >>> failure = Failure(4, "elbow", 0.63, 0.16, 3.9, (), "elbow (joint 4): error 0.63 N m.")
    >>> failure.ratio
    3.9
    """

    joint: int
    name: str
    rmse: float
    noise: float
    ratio: float
    places: tuple[Place, ...]
    sentence: str


@dataclass(frozen=True)
class RestError:
    """Error of a joint at rest, where dry friction can balance any torque up to its limit.

    Parameters
    ----------
    joint : int
        Joint, counted from 1.
    name : str
        Its name.
    rmse : float
        Root mean square error at rest, N m or N.
    stiction : float or None
        Limit of dry friction in the model, N m or N; None if it is unknown.
    beyond : float or None
        Root mean square of the error that exceeds it, N m or N.
    share_of_time : float
        Share of the samples at rest.
    sentence : str
        The same in words.

    Examples
    --------
    >>> error = RestError(2, "shoulder", 1.9, 2.4, 0.0, 0.14, "At rest ...")
    >>> error.beyond
    0.0
    """

    joint: int
    name: str
    rmse: float
    stiction: float | None
    beyond: float | None
    share_of_time: float
    sentence: str


def find_failures(comparison: Comparison, noise: ArrayLike) -> list[Failure]:
    """Joints whose error on judged samples exceeds the noise, the largest ratio first.

    Parameters
    ----------
    comparison : Comparison
        Measured against predicted torque.
    noise : array-like of shape (n_joints,), N m or N
        Noise of every joint.

    Returns
    -------
    list of Failure
        Empty if no joint exceeds its noise.
    """
    levels = np.asarray(noise, dtype=float)
    floor = ROUNDING * np.sqrt(np.mean(comparison.measured**2, axis=0))
    levels = np.maximum(np.maximum(levels, floor), 1e-300)
    found = []
    for j, rmse in enumerate(comparison.rmse(judged=True)):
        ratio = float(rmse / levels[j])
        if not ratio >= FAILS:  # so that an unknown noise gives no failure
            continue
        places = _places(comparison, j, float(levels[j]))
        name, unit = comparison.joint_names[j], comparison.units[j]
        sentence = (
            f"{name} (joint {j + 1}): error {digits(rmse)} {unit}, {times(ratio)} its noise of "
            f"{digits(levels[j])} {unit}. {_told(places)}"
        )
        found.append(Failure(j + 1, name, float(rmse), float(levels[j]), ratio, places, sentence))
    return sorted(found, key=lambda f: (-f.ratio, f.joint))


def find_rest_errors(comparison: Comparison) -> list[RestError]:
    """Errors of the joints at rest, compared with the limit of dry friction.

    Parameters
    ----------
    comparison : Comparison
        Measured against predicted torque.

    Returns
    -------
    list of RestError
        In the order of the joints.
    """
    rest = regimes(comparison)["rest"]
    found = []
    for j, name in enumerate(comparison.joint_names):
        here = rest[:, j]
        if here.sum() < FEWEST or here.mean() < SHORTEST:
            continue
        residual, unit = comparison.residual[here, j], comparison.units[j]
        rmse, stiction, beyond = float(np.sqrt(np.mean(residual**2))), None, None
        text = f"{name} (joint {j + 1}): error {rmse:.2g} {unit} at rest"
        if comparison.dry_friction is None:
            text += "; this model does not determine how much of it dry friction can balance"
        else:
            friction = comparison.dry_friction[:, j]
            stiction = float(np.abs(friction).max())
            # the friction at rest in the model is one of many possible values
            free = residual + friction[here]
            beyond = float(np.sqrt(np.mean(np.maximum(np.abs(free) - stiction, 0.0) ** 2)))
            text += (
                " (root mean square); dry friction can balance any torque up to "
                f"{stiction:.2g} {unit}"
            )
            if beyond > 0.1 * rmse:
                text += (
                    f", and what it cannot balance in single samples is {beyond:.2g} {unit} "
                    "(root mean square)"
                )
        found.append(RestError(j + 1, name, rmse, stiction, beyond, float(here.mean()), text + "."))
    return found


def _places(comparison: Comparison, joint: int, noise: float) -> tuple[Place, ...]:
    """Places of the excess of a joint."""
    judged = np.flatnonzero(comparison.judged_samples[:, joint])
    excess = comparison.residual[judged, joint] ** 2 - noise**2
    share = excess / excess.sum()
    places = _regime_places(comparison, joint, judged, share)
    position = _position_place(comparison, joint, judged, share)
    which = _trajectory_place(comparison, judged, share)
    when = _time_place(comparison, judged, share)
    if when and which and when.share_of_time > NARROWER * which.share_of_time:
        when = None  # nearly the whole trajectory, which is reported already
    return (*places, *(place for place in (position, which, when) if place is not None))


def _stands_out(excess: float, time: float, share: float = SHARE, odds: float = ODDS) -> bool:
    return 0 < time < 1 and excess >= share and excess * (1 - time) >= odds * time * (1 - excess)


def _regime_places(
    comparison: Comparison, joint: int, judged: NDArray[np.intp], share: Array
) -> list[Place]:
    """At most two regimes with most of the excess, the largest first."""
    found = []
    for regime, mask in regimes(comparison).items():
        here = mask[judged, joint]
        excess, time = float(share[here].sum()), float(here.mean())
        if regime in _WHERE and _stands_out(excess, time):
            found.append(Place("regime", _WHERE[regime], min(excess, 1.0), time, regime))
    return sorted(found, key=lambda place: -place.share_of_excess)[:2]


def _position_place(
    comparison: Comparison, joint: int, judged: NDArray[np.intp], share: Array
) -> Place | None:
    """The range of the joint's own position in which the excess is densest."""
    q = comparison.signals.q[judged, joint]
    edges = np.quantile(q, np.linspace(0, 1, POSITIONS + 1))
    part = np.clip(np.searchsorted(edges, q, side="right") - 1, 0, POSITIONS - 1)
    first, last = _densest(*_sums(part, share, POSITIONS))
    here = (part >= first) & (part <= last)
    excess, time = float(share[here].sum()), float(here.mean())
    if not _stands_out(excess, time):
        return None
    low, high = float(edges[first]), float(edges[last + 1])
    unit = "m" if comparison.signals.prismatic[joint] else "rad"
    where = f"at positions from {low:.2f} to {high:.2f} {unit}"
    return Place("position", where, min(excess, 1.0), time, low=low, high=high)


def _trajectory_place(
    comparison: Comparison, judged: NDArray[np.intp], share: Array
) -> Place | None:
    """The trajectories in which the excess is densest."""
    names, part = np.unique(comparison.signals.trajectory[judged], return_inverse=True)
    excess, time = _sums(part, share, len(names))
    order = np.argsort(-excess / time)
    gained = np.cumsum(excess[order]), np.cumsum(time[order])
    k = int(np.argmax(gained[0] - gained[1]))
    held, spent = float(gained[0][k]), float(gained[1][k])
    if not _stands_out(held, spent):
        return None
    which = tuple(sorted(int(name) for name in names[order[: k + 1]]))
    where = f"in {trajectories_told(which)}"
    return Place("trajectory", where, min(held, 1.0), spent, trajectories=which)


def _time_place(comparison: Comparison, judged: NDArray[np.intp], share: Array) -> Place | None:
    """One interval of time within a trajectory with most of the excess."""
    trajectory, clock = comparison.signals.trajectory, comparison.signals.clock
    whole = len(judged)
    best: tuple[float, float, Place] | None = None
    for name in np.unique(trajectory[judged]):
        begin = float(clock[trajectory == name].min())
        here = trajectory[judged] == name
        time, own = clock[judged][here] - begin, share[here]
        edges = np.linspace(time.min(), time.max() + 1e-9, TIMES + 1)
        part = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, TIMES - 1)
        excess, spent = _sums(part, own, TIMES)
        spent = spent * len(part) / whole
        first, last = _densest(excess, spent)
        held, lasted = float(excess[first : last + 1].sum()), float(spent[first : last + 1].sum())
        if not _stands_out(held, lasted, TIME_SHARE, TIME_ODDS):
            continue
        low, high = float(edges[first]), float(edges[last + 1])
        where = f"{span_told(low, high)} of trajectory {int(name)}"
        place = Place(
            "time", where, min(held, 1.0), lasted, low=low, high=high, trajectories=(int(name),)
        )
        if best is None or held - lasted > best[0] - best[1]:
            best = (held, lasted, place)
    return None if best is None else best[2]


def _sums(part: NDArray[np.intp], share: Array, n: int) -> tuple[Array, Array]:
    """Share of the excess and of the samples in every part."""
    sums: Array = np.bincount(part, share, n).astype(float)
    return sums, np.bincount(part, minlength=n) / len(part)


def _densest(excess: Array, time: Array) -> tuple[int, int]:
    """First and last part of the run with the most excess beyond its share of time."""
    total = np.concatenate([[0.0], np.cumsum(excess - time)])
    lowest = np.maximum.accumulate(-total)
    last = int(np.argmax(total[1:] + lowest[:-1]))
    return int(np.argmin(total[: last + 1])), last


def _told(places: Sequence[Place]) -> str:
    if not places:
        return "The excess is spread over the whole motion."
    parts = [
        f"{p.share_of_excess:.0%} lies {p.where} ({p.share_of_time:.0%} of the time)"
        for p in places
    ]
    return f"Of the excess over the noise, {listed(parts)}."
