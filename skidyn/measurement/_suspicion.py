# SPDX-License-Identifier: BSD-3-Clause
"""Suspicions of checks about a measurement, and the options that fix them."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

#: ``certain``: the measurement does not agree with its names and units, and no diagnosis of it is
#: valid. ``suspected``: it probably does not. ``noted``: it does, but has a limitation.
Certainty = Literal["certain", "suspected", "noted"]
CERTAINTIES: tuple[Certainty, ...] = ("certain", "suspected", "noted")


@dataclass(frozen=True)
class Remedy:
    """The option that fixes a suspicion.

    Parameters
    ----------
    option : str
        Option of the command line, ``"--flip elbow"``.
    code : str
        The same as an argument of :func:`skidyn.logs.read_log`, ``"flip=['elbow']"``.

    Examples
    --------
    >>> from skidyn.measurement import Remedy
    >>> str(Remedy("--flip elbow", "flip=['elbow']"))
    "--flip elbow (in Python: flip=['elbow'])"
    >>> Remedy("--flip elbow", "flip=['elbow']").arguments
    {'flip': ['elbow']}
    """

    option: str
    code: str

    @property
    def arguments(self) -> dict[str, Any]:
        """The arguments of ``read_log``; empty if it is not one of them."""
        call = ast.parse(f"read_log({self.code})", mode="eval").body
        assert isinstance(call, ast.Call)
        return {k.arg: ast.literal_eval(k.value) for k in call.keywords if k.arg}

    def __str__(self) -> str:
        return f"{self.option} (in Python: {self.code})"


def remedy_of(argument: str, value: Any) -> tuple[str, str]:
    """An argument of ``read_log`` as an option of the command line, and in Python.

    Parameters
    ----------
    argument : str
        Its name.
    value : bool, str, list or dict
        Its value; numbers keep all their digits.

    Examples
    --------
    >>> remedy_of("gain", {"tau1": 0.001, "tau2": 0.5})
    ('--gain tau1=0.001,tau2=0.5', "gain={'tau1': 0.001, 'tau2': 0.5}")
    >>> remedy_of("flip", ["q1", "tau1"]), remedy_of("drop_repeated", True)
    (('--flip q1,tau1', "flip=['q1', 'tau1']"), ('--drop-repeated', 'drop_repeated=True'))
    """
    option = f"--{argument.replace('_', '-')}"
    if value is not True:
        option += f" {_in_option(value)}"
    return option, f"{argument}={value!r}"


def resample_to(rate: float) -> tuple[str, str]:
    """The option, and the argument of ``read_log``, for a rounded sampling rate, Hz."""
    return f"--resample {rate:g}", f"resample_rate={rate:g}"


def names_in_option(quantity: str, joints: Sequence[int], n_joints: int) -> list[str]:
    """Name of a quantity in an option if it is that of all joints, otherwise of its columns.

    >>> names_in_option("dq", [0, 1], 2), names_in_option("dq", [1], 2)
    (['dq'], ['dq2'])
    """
    return [quantity] if len(joints) == n_joints else [f"{quantity}{k + 1}" for k in joints]


def _in_option(value: Any) -> str:
    if isinstance(value, dict):
        return ",".join(f"{name}={_in_option(own)}" for name, own in value.items())
    if isinstance(value, list):
        return ",".join(map(_in_option, value))
    return exactly(value) if isinstance(value, float) else str(value)


def exactly(value: float) -> str:
    """A number as short as possible, but with all digits.

    Parameters
    ----------
    value : float
        A number.

    Examples
    --------
    >>> exactly(-1.0), exactly(65535.0), exactly(174.51514)
    ('-1', '65535', '174.51514')
    """
    short = f"{value:g}"
    return short if float(short) == value else repr(value).removesuffix(".0")


@dataclass(frozen=True)
class Suspicion:
    """One finding of a check of a measurement.

    Parameters
    ----------
    check : str
        Name of the check.
    suspicion : str
        The suspicion, as a clause.
    evidence : str
        The evidence.
    certainty : {"certain", "suspected", "noted"}
        Certain ones stop a diagnosis; noted ones are not mistakes, but limitations of the log.
    joints : tuple of int
        Joints concerned, counted from 1; empty if it concerns the whole log.
    remedy : Remedy or None
        The option that fixes it; None if there is none.
    influence : float or None
        Share of the error of the robot's model, with stated or with identified bodies, that the
        remedy alone removes; None if it was not determined (:func:`skidyn.logs.check_log`).

    Examples
    --------
    >>> from skidyn.measurement import Suspicion
    >>> print(Suspicion("clock_unit", "time is in ms", "the median step is 10 s", "certain"))
    time is in ms: the median step is 10 s.
    """

    check: str
    suspicion: str
    evidence: str
    certainty: Certainty
    joints: tuple[int, ...] = ()
    remedy: Remedy | None = None
    influence: float | None = None

    @property
    def benefit(self) -> str:
        """The influence of the remedy in words; empty if it is below half a per cent."""
        if self.influence is None or self.influence < 0.005:
            return ""
        return f"alone, it removes {100 * self.influence:.0f} % of the error of the robot's model"

    def __str__(self) -> str:
        fix = "" if self.remedy is None else f" Fix it with {self.remedy}."
        return f"{self.suspicion}: {self.evidence}.{fix}"

    def to_dict(self) -> dict[str, Any]:
        """As in the reports.

        Returns
        -------
        dict
            ``check, suspicion, evidence, certainty, joints``, ``remedy`` (``option`` and ``code``,
            or None) and ``influence``.
        """
        remedy = self.remedy and {"option": self.remedy.option, "code": self.remedy.code}
        return {
            "check": self.check,
            "suspicion": self.suspicion,
            "evidence": self.evidence,
            "certainty": self.certainty,
            "joints": list(self.joints),
            "remedy": remedy,
            "influence": self.influence,
        }


def paragraphs(found: Iterable[Suspicion]) -> list[str]:
    """Suspicions as lines of text, with evidence and remedies.

    Parameters
    ----------
    found : iterable of Suspicion
        Suspicions.

    Returns
    -------
    list of str
        Two or three lines for each.
    """
    lines = []
    for told in found:
        mark = {"certain": "!!", "suspected": "! ", "noted": "- "}[told.certainty]
        lines.append(f"{mark} {told.suspicion} ({told.certainty})")
        lines.append(f"   {told.evidence}")
        if told.remedy is not None:
            benefit = f"  ({told.benefit})" if told.benefit else ""
            lines.append(f"   fix it with: {told.remedy.option}{benefit}")
    return lines
