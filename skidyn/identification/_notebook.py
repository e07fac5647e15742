# SPDX-License-Identifier: BSD-3-Clause
"""A fitted model in a notebook: its effects in numbers, and the noise of every joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from skidyn._signals import Array
from skidyn._text import digits, measure
from skidyn.effects import Term
from skidyn.robots import Robot

#: Half the width of a 95 % interval in standard errors.
NORMAL = 1.96


def model_table(
    robot: Robot, terms: Sequence[Term], stated: Mapping[str, tuple[float, float]], noise: Array
) -> str:
    """One row per joint with its effects and its noise, as HTML in which every text is escaped.

    ``stated`` are value and standard error of every coefficient, ``noise`` the standard deviation
    of the residual of every joint, N m or N.
    """
    rows = []
    for j, name in enumerate(robot.joint_names):
        slides = robot.joint_types[j] == "prismatic"
        told = []
        for term in terms:
            if j not in term.places:
                continue
            units = term.effect.units(slides)
            for coefficient, column in zip(term.coefficients, term.names, strict=True):
                value, std = stated.get(column, (float("nan"), float("nan")))
                interval = (value, value - NORMAL * std, value + NORMAL * std)
                told.append(measure(coefficient.name, interval, units.get(coefficient.name, "")))
        rows.append(
            f"<tr><td style='text-align:left'>{escape(name)} ({j + 1})</td>"
            f"<td style='text-align:left'>{escape(', '.join(told)) or '–'}</td>"
            f"<td>{digits(float(noise[j]))} {'N' if slides else 'N m'}</td></tr>"
        )
    return (
        "<table><thead><tr><th style='text-align:left'>Joint</th><th "
        "style='text-align:left'>Effects, with 95 % "
        f"intervals</th><th>Residual</th></tr></thead><tbody>{''.join(rows)}</tbody></table>"
    )
