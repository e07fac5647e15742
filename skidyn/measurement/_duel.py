# SPDX-License-Identifier: BSD-3-Clause
"""Comparison of another reading with physical effects that could look like it.

A contact changes the torque of a joint like another zero of its position, and a spring between two
joints like another sign. So a reading is compared with every effect of the catalogue that needs
only the motion, on the joints concerned. In both fits bodies may differ from those of the
description: a reading that is supported only by wrong bodies has no gain, and bodies of negative
mass cannot replace a sign. The permitted difference is the one with the largest likelihood, so that
a description that fits to 3 % in one reading and to 30 % in another supports the first.

A joint between whose encoder and link a gear gives way has another position under a weight that
pulls to one side, as with another zero. It is compared with a zero as effects are, although its
columns depend on the torque.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from skidyn.effects import Effect, get_effect, searched_kinds
from skidyn.measurement._fits import Fits
from skidyn.measurement._near_bodies import (
    LOOSE,
    ExtraColumns,
    Factored,
    NearBodies,
    likely_load,
)
from skidyn.measurement._reading import Reading

#: Number of effects that are examined in detail against a reading, and against a change of a single
#: joint, for which fewer effects are possible.
FINALISTS, OF_ONE_JOINT = 5, 4
#: Angle for the change of the torque with a position, rad.
SLOPE = 1e-4
#: Penalty of each parameter of an effect in log-likelihood: half the logarithm of some 150 rows.
COST = 2.5

#: An effect with columns in one shape, and its penalty.
Rival: TypeAlias = tuple[Effect, ExtraColumns, float]


@dataclass(frozen=True)
class Duel:
    """A reading compared with the effect that reduces its gain most.

    Attributes
    ----------
    gain : float
        Log-likelihood gain of the reading over the unchanged log, if bodies may differ.
    beside : float
        The smaller of its gains with and without the effect.
    rival : float
        Gain of the effect over the unchanged log, minus the penalty of its parameters.
    effect : str
        Title of the effect; empty if none reduces the gain of the reading.
    """

    gain: float
    beside: float
    rival: float = 0.0
    effect: str = ""


def fight(fits: Fits, before: Reading, reading: Reading, joints: Sequence[int]) -> Duel:
    """Compare a reading with the effects that could look like it.

    Parameters
    ----------
    fits : Fits
        Rows.
    before, reading : Reading
        The present and the suspected reading of the log.
    joints : sequence of int
        Joints, from 0, on which effects are tried.
    """
    # both have the scale of the torque that the reading implies
    gains = np.nan_to_num(fits.nominal(reading).gain)
    inflation = fits.identified(before).inflation
    here, there = (NearBodies(fits, r, gains, inflation) for r in (before, reading))
    also = [] if reading.zero == before.zero else _giving_way(here)
    return duel_of(here, there, joints, also=also)


def duel_of(
    here: NearBodies,
    there: NearBodies,
    joints: Sequence[int],
    but: Sequence[str] = (),
    also: Sequence[Rival] = (),
) -> Duel:
    """Compare one fit with another and with the effects that could look like it.

    Parameters
    ----------
    here, there : NearBodies
        The present and the suspected reading of the log, or description of the robot.
    joints : sequence of int
        Joints, from 0, on which effects are tried.
    but : sequence of str, default=()
        Kinds of effects that are not tried.
    also : sequence of (Effect, ExtraColumns, float), default=()
        Further effects, with their columns and penalties.

    Returns
    -------
    Duel
    """
    plain = here.plain.posterior
    gain = there.plain.posterior - plain
    duel = Duel(gain, gain)
    if gain <= 0:
        return duel  # effects only make it smaller
    for effect, columns, cost in (*_likely(here, joints, but=but), *also):
        with_it = here.fit(columns).posterior
        rival = with_it - cost - plain
        if rival <= 0:
            continue  # it does not reduce the gain of the reading
        beside = there.fit(columns).posterior - with_it
        if beside < duel.beside:
            duel = Duel(gain, beside, rival, effect.title)
    return duel


def left_by_effects(fits: Fits, joint: int, rows: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Residual of some rows, and the least residual with an effect on their joint.

    Parameters
    ----------
    fits : Fits
        Rows.
    joint : int
        Joint, from 0.
    rows : ndarray of shape (n_rows,) of bool
        Rows of a recording that seems to have another torque: a payload or a force at the tool may
        act in it alone.

    Returns
    -------
    without, least : float
        Root mean squares of the residual over its scale in all rows.
    torque : float, N m or N
        Least root mean square residual with an effect.
    """
    reading = Reading()
    gains = np.nan_to_num(fits.nominal(reading).gain)
    here = NearBodies(fits, reading, gains, fits.identified(reading).inflation)
    k = here.joints.index(joint)
    own = rows[here.rows[k]]
    everywhere, there = _likely(here, [joint]), _likely(here, [joint], rows)
    effects = [*everywhere[:OF_ONE_JOINT], *there[:OF_ONE_JOINT]]
    fits_of = [here.plain, *(here.fit(columns) for _, columns, _ in effects)]
    left = [float(np.sqrt(np.mean(fit.residuals[k][own] ** 2))) for fit in fits_of]
    scaled = [x / fit.scales[k] for x, fit in zip(left, fits_of, strict=True)]
    return scaled[0], min(scaled), min(left)


def gained_over_effects(fits: Fits, mended: Fits, joint: int, rows: NDArray[np.bool_]) -> float:
    """Log-likelihood that a corrected log gains more than an effect in the same recordings does.

    Parameters
    ----------
    fits, mended : Fits
        Rows as they are, and with the correction.
    joint : int
        Joint, from 0, on which effects are tried.
    rows : ndarray of shape (n_rows,) of bool
        Rows of the recordings that are corrected.

    Returns
    -------
    float
        Negative if an effect is likelier. Bodies may differ from those of the description in both.
    """
    reading = Reading()
    inflation = fits.identified(reading).inflation
    here, there = (
        NearBodies(f, reading, np.nan_to_num(f.nominal(reading).gain), inflation)
        for f in (fits, mended)
    )
    effects = _likely(here, [joint], rows)[:OF_ONE_JOINT]
    rivals = [here.fit(columns).posterior - cost for _, columns, cost in effects]
    return there.plain.posterior - max(rivals, default=here.plain.posterior)


def _effects() -> Iterator[Effect]:
    """Effects of the catalogue that depend only on the present motion."""
    for kind in searched_kinds():
        effect = get_effect(kind)
        plain = not set(effect.needs) - {"robot"} and effect.search != "spectrum"
        # the direction of gravity is a reading itself
        if plain and not effect.nameless and effect.family != "hysteresis" and kind != "base_tilt":
            yield effect


def _likely(
    bodies: NearBodies,
    joints: Sequence[int],
    rows: NDArray[np.bool_] | None = None,
    but: Sequence[str] = (),
) -> list[Rival]:
    """The most promising effects on some joints, in their best shapes, with their penalties.

    Where rows are given, the effects are those that may act in one recording alone, in them.
    """
    factor = Factored(bodies.plain.gram)
    promising = []
    for effect in _effects():
        if rows is not None and not (effect.by_recording or effect.search == "trajectories"):
            continue
        if effect.kind in but:
            continue
        tried = [
            (bodies.promise(columns, factor), columns)
            for columns in _shapes(effect, bodies, joints, rows)
        ]
        if tried:
            gain, columns = max(tried, key=lambda pair: pair[0] - COST * pair[1].count)
            zeros = sum(c.is_zero for c in effect.coefficients)
            counted = columns.count - zeros
            counted += sum(s.name not in effect.form_names for s in effect.shapes)
            cost = COST * counted
            promising.append((gain - cost, effect, columns, cost))
    promising.sort(key=lambda item: -item[0])
    return [(effect, columns, cost) for _, effect, columns, cost in promising[:FINALISTS]]


def _giving_way(bodies: NearBodies) -> list[Rival]:
    """The joint whose elasticity is most promising, of those that turn: one coefficient.

    Its position differs from that of its encoder by its torque over its stiffness.
    """
    s, fits, reading = bodies.signals, bodies.fits, bodies.reading
    robot, factor, tried = s.robot, Factored(bodies.plain.gram), []
    assert robot is not None
    still = robot.inverse_dynamics(s.q, s.dq, s.ddq, backend="once")
    columns = [reading.torque_column(j) for j in range(fits.n_joints)]
    for j in np.flatnonzero(~s.prismatic).tolist():
        column, sign = columns[j]
        q = s.q.copy()
        q[:, j] -= SLOPE
        slope = (robot.inverse_dynamics(q, s.dq, s.ddq, backend="once") - still) / SLOPE
        change = fits.average(slope * (sign * fits.torque[:, [column]]))
        size = float(np.sqrt(np.mean(change**2))) + 1e-12
        felt = {i: bodies.gains[columns[i][0]] * change[:, [i]] / size for i in bodies.joints}
        extra = ExtraColumns(felt, (0,), np.array([LOOSE]))
        tried.append((bodies.promise(extra, factor), extra))
    if not tried:
        return []
    _, best = max(tried, key=lambda pair: pair[0])
    return [(get_effect("joint_elasticity"), best, COST)]


def _shapes(
    effect: Effect, bodies: NearBodies, joints: Sequence[int], rows: NDArray[np.bool_] | None
) -> Iterator[ExtraColumns]:
    """Columns of an effect on some joints, in all shapes of its grid."""
    signals, fits = bodies.signals, bodies.fits
    robot = signals.robot if effect.kind == "payload" else None  # it is only another body
    if robot is not None:
        known = likely_load(robot)
    for site in effect.sites(signals):
        if not set(site) & set(joints):
            continue
        if effect.scope != "robot" and any(effect.not_shown(signals, j) for j in site):
            continue
        # a payload or a wrench is tried in all recordings, where other links are other bodies
        grid = effect.grid(signals, site) if effect.search == "grid" else [{}]
        grid = grid if rows is None else [*grid, *effect.elsewhere(signals)]
        for shape in grid:
            if not effect.admissible(signals, site, shape):
                continue
            coefficients = effect.coefficients_of(shape)
            if len(coefficients) > len(effect.coefficients):
                continue  # a form with more of them could explain anything in a simple motion
            spread = np.full(len(coefficients), np.inf) if robot is None else known
            positive = tuple(k for k, c in enumerate(coefficients) if c.sign == 1)
            if robot is not None:
                # a load missing in one recording may be present in the others: its mass is negative
                positive = (0,) if rows is None else ()
            columns = {
                j: fits.average(np.asarray(values))
                for j, values in effect.torque_columns(signals, site, **shape).items()
            }
            if rows is not None:
                columns = {j: c * rows[:, None] for j, c in columns.items()}
            size = np.sqrt(sum(np.mean(c**2, axis=0) for c in columns.values())) + 1e-12
            scaled = {j: c / size for j, c in columns.items()}
            yield ExtraColumns(scaled, positive, LOOSE + 1 / (spread * size) ** 2)
