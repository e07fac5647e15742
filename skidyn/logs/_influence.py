# SPDX-License-Identifier: BSD-3-Clause
"""Suspicions in the order of how much their remedies change the answer."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from skidyn._exceptions import LogWarning, SkidynError
from skidyn._signals import Array
from skidyn.logs._files import Channel
from skidyn.logs._remedies import Remedies, turn_gravity
from skidyn.logs._table import TableOptions, build_table

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.measurement import Measurement, Remedy, Suspicion
    from skidyn.robots import Robot


def by_influence(
    frame: pd.DataFrame,
    robot: Robot,
    checks: Sequence[Suspicion],
    measured: Callable[[pd.DataFrame, Robot], Measurement],
    corrected: Robot | None = None,
) -> list[Suspicion]:
    """Suspicions with the influence of their remedies, in the order of it.

    The influence is the share of the error of the robot's model that a remedy alone removes.
    Certain suspicions stay before suspected ones, and those without a known influence come last.
    ``robot`` is that of the description; the correction by which the checks have replaced it has an
    influence as well.
    """
    from skidyn.measurement import CERTAINTIES, errors_of_fits

    remedies = [None if told.certainty == "noted" else told.remedy for told in checks]
    changed = corrected is not None and corrected is not robot
    described = errors_of_fits(measured(frame, robot)) if any(remedies) or changed else None
    if described is None:
        return list(checks)
    if changed and corrected is not None:
        robot = corrected
    before = errors_of_fits(measured(frame, robot)) if changed else described
    if before is None:
        return list(checks)
    found = []
    for told, remedy in zip(checks, remedies, strict=True):
        after = None
        if changed and told.check == "description_units":
            told = replace(told, influence=_removed(described, before))
        elif remedy is not None:
            try:
                after = errors_of_fits(measured(*_mended(frame, robot, remedy)))
            except SkidynError:
                pass  # a remedy that is possible only with another one has no influence of its own
        if after is not None:
            told = replace(told, influence=_removed(before, after))
        found.append(told)

    def place(told: Suspicion) -> tuple[int, float]:
        known = told.influence
        return CERTAINTIES.index(told.certainty), 1.0 if known is None else -known

    return sorted(found, key=place)


def _removed(before: Array, after: Array) -> float:
    """Largest share of an error that is no longer there; none of an error of zero."""
    left = np.divide(after, before, out=np.ones_like(before), where=before > 0)
    return float(np.max(1 - left).clip(0.0, 1.0))


def _mended(frame: pd.DataFrame, robot: Robot, remedy: Remedy) -> tuple[pd.DataFrame, Robot]:
    """A log with a remedy, and its robot."""
    said = dict(remedy.arguments)
    if "gravity" in said:
        robot = turn_gravity(robot, said.pop("gravity"), [])
    own = {f.name for f in fields(Remedies)} & set(said)
    options = TableOptions(
        robot=robot,
        split_gaps=None,
        remedies=Remedies(**{name: said.pop(name) for name in own}),
        **said,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return build_table([Channel("log", frame)], "the log", options)[0], robot
