# SPDX-License-Identifier: BSD-3-Clause
"""Conversion of the units of a log to SI."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from skidyn._exceptions import LogError

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.robots import Robot

_ANGLE = {"rad": 1.0, "deg": np.pi / 180, "rev": 2 * np.pi, "mrad": 1e-3}
_LENGTH = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}
_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
_TORQUE = {"Nm": 1.0, "N m": 1.0, "N*m": 1.0, "mNm": 1e-3, "Ncm": 1e-2, "Nmm": 1e-3, "kNm": 1e3}
_FORCE = {"N": 1.0, "kN": 1e3, "mN": 1e-3}
_MOTION = {**_ANGLE, **_LENGTH}
#: Quantities that are angles of turning joints and lengths of sliding ones, or their rates.
_OF_MOTION = ("q", "dq", "ddq", "cmd")
#: Factor to SI of each unit, per quantity. Temperatures are treated separately (they have offsets).
FACTORS: dict[str, dict[str, float]] = {
    "q": _MOTION,
    "dq": {f"{unit}/s": factor for unit, factor in _MOTION.items()} | {"rpm": 2 * np.pi / 60},
    "ddq": {f"{unit}/s^2": factor for unit, factor in _MOTION.items()},
    "tau": {**_TORQUE, **_FORCE},
    "cmd": _MOTION,
    "i": {"A": 1.0, "mA": 1e-3},
    "time": _TIME,
    "temp": {"C": 1.0, "K": 1.0, "F": 5 / 9},
}
#: Other spellings of units in the headers of tables, compared in lower case without blanks.
_SPELLED = {
    **{"°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad"},
    **{"°/s": "deg/s", "rad/sec": "rad/s", "deg/sec": "deg/s"},
    **{"rad/s2": "rad/s^2", "rad/s²": "rad/s^2", "deg/s2": "deg/s^2", "m/s2": "m/s^2"},
    **{"n·m": "Nm", "n.m": "Nm", "sec": "s", "secs": "s", "second": "s", "seconds": "s"},
    **{"msec": "ms", "millisecond": "ms", "milliseconds": "ms", "µs": "us", "usec": "us"},
    **{"amp": "A", "amps": "A", "ampere": "A", "°c": "C", "celsius": "C", "kelvin": "K"},
}
_KNOWN = {unit.lower().replace(" ", ""): unit for units in FACTORS.values() for unit in units}
#: Names of clocks that end in their unit.
_CLOCK = re.compile(r"(.*?(?:time|stamp|\bt))[ _](s|secs?|seconds?|ms|us|ns)", re.IGNORECASE)
_TEMPERATURE_ZERO = {"C": 0.0, "K": 273.15, "F": 32.0}


def split_unit(name: str) -> tuple[str, str | None]:
    """Name of a column without the unit in brackets after it, or after a time, and that unit.

    >>> split_unit("q1 [deg]"), split_unit("Time (ms)"), split_unit("q[1]"), split_unit("q (raw)")
    (('q1', 'deg'), ('Time', 'ms'), ('q[1]', None), ('q (raw)', None))
    >>> split_unit("timestamp_ns"), split_unit("t_ms"), split_unit("tau_s")
    (('timestamp', 'ns'), ('t', 'ms'), ('tau_s', None))
    """
    if not name.rstrip().endswith((")", "]")):
        clock = _CLOCK.fullmatch(name)
        return (clock[1], _SPELLED.get(clock[2].lower(), clock[2])) if clock else (name, None)
    hit = re.fullmatch(r"(.*?)[ _]*[\[(]([^\[\]()]*)[\])] *", name)
    if hit is None or not hit[1]:
        return name, None
    plain = hit[2].strip()
    word = plain.lower().replace(" ", "")
    # mNm and MNm differ only by case, so the unit as written has priority
    exact = next((u for units in FACTORS.values() for u in units if u == plain), None)
    unit = exact or _SPELLED.get(word) or _KNOWN.get(word)
    return (hit[1], unit) if unit else (name, None)


def refuse_stated_units(
    stated: Mapping[str, tuple[str, str]], units: Mapping[str, str], source: str
) -> None:
    """Refuse columns whose header states a unit that is not SI, unless a conversion is requested.

    ``stated`` holds the column of the source and its unit; the LogError contains the ``units`` to
    pass.
    """
    wanted: dict[str, str] = {}
    example = ""
    for target, (name, unit) in stated.items():
        quantity = re.sub(r"\d+$", "", target)
        factor = FACTORS.get(quantity, {}).get(unit)
        if factor is None or (factor == 1 and unit != "K") or {target, quantity} & set(units):
            continue
        wanted[quantity if wanted.get(quantity, unit) == unit else target] = unit
        example = example or f"column {name!r} states {unit}"
    if wanted:
        raise LogError(
            f"{source}: {example}; a log is in SI units. To convert it, pass units={wanted} "
            f"(--units {','.join(map('='.join, wanted.items()))} on the command line)."
        )


def units_of_joints(
    units: Mapping[str, str], columns: Sequence[str], robot: Robot, notes: list[str]
) -> dict[str, str]:
    """Units for the columns of joints that can have them: angles of turning, lengths of sliders.

    The unit of a quantity is that of its columns with such joints, which is appended to ``notes``
    where others keep SI units. A LogError is raised for a column with a joint of the other kind,
    or a quantity without any of its kind.
    """
    slides = [kind == "prismatic" for kind in robot.joint_types]
    own: dict[str, str] = {}
    for target, unit in units.items():
        quantity = target.rstrip("0123456789")
        length = unit.split("/")[0] in _LENGTH
        if quantity not in _OF_MOTION or FACTORS[quantity].get(unit, 1.0) == 1.0:
            own[target] = unit
            continue
        named = (
            [target] if target in columns else [f"{quantity}{k + 1}" for k in range(len(slides))]
        )
        named = [
            name for name in named if name in columns and (name == target or name not in units)
        ]
        joints = [int(name[len(quantity) :]) - 1 for name in named]
        other = [k for k in joints if k < len(slides) and slides[k] != length]
        if not other:
            own[target] = unit
            continue
        names = ", ".join(f"{quantity}{k + 1} ({robot.joint_names[k]})" for k in other)
        verb = "slides" if len(other) == 1 else "slide"
        verb = verb if not length else verb.replace("slide", "turn")
        if len(other) == len(joints):
            per = "/".join(["", *unit.split("/")[1:]])
            right = ", ".join(f"{word}{per}" for word in (_ANGLE if length else _LENGTH))
            raise LogError(
                f"units: {unit!r} is no unit of {names}, which {verb}; use one of {right}, or "
                "leave it out."
            )
        own |= {f"{quantity}{k + 1}": unit for k in joints if k not in other}
        notes.append(
            f"units: {unit} was not applied to {names}, which {verb}; if a unit of "
            f"{'angles' if length else 'lengths'} is needed, give it by column"
        )
    return own


def convert_units(frame: pd.DataFrame, units: Mapping[str, str]) -> pd.DataFrame:
    """Convert columns of a log to SI; the given table is not changed.

    Units are those of a quantity (``{"q": "deg", "time": "ms"}``) or of one column (``{"q3":
    "mm"}``), which has priority. A LogError is raised if a quantity or unit is unknown, or the log
    does not have the quantity.

    >>> import pandas as pd
    >>> convert_units(pd.DataFrame({"q1": [180.0]}), {"q": "deg"}).q1.round(4).tolist()
    [3.1416]
    """
    frame = frame.copy(deep=False)  # whole columns are replaced
    for target, unit in units.items():
        quantity = re.sub(r"\d+$", "", target)
        if quantity not in FACTORS:
            raise LogError(f"units: {target!r} is not a quantity; use one of {', '.join(FACTORS)}.")
        if unit not in FACTORS[quantity]:
            raise LogError(
                f"units: {unit!r} is not a unit of {quantity}; use {', '.join(FACTORS[quantity])}."
            )
        chosen = [target] if target in frame.columns else _columns_of(target, frame, units)
        if not chosen:
            raise LogError(f"units: the log has no {target}.")
        for name in chosen:
            values = frame[name].to_numpy(dtype=float)
            zero = _TEMPERATURE_ZERO[unit] if quantity == "temp" else 0.0
            frame[name] = (values - zero) * FACTORS[quantity][unit]
    return frame


def _columns_of(quantity: str, frame: pd.DataFrame, units: Mapping[str, str]) -> list[str]:
    """Columns of a quantity without separate entries in ``units``."""
    return [
        name
        for name in frame.columns
        if re.fullmatch(rf"{quantity}\d+", str(name)) and name not in units
    ]
