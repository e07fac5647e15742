# SPDX-License-Identifier: BSD-3-Clause
"""Words and the remedy for values that stand for missing ones."""

from __future__ import annotations

from collections.abc import Sequence

from skidyn._text import joints_told, listed
from skidyn.measurement._suspicion import names_in_option, remedy_of

#: Quantities of a measurement, and their plurals.
CHANNELS = {"q": "positions", "dq": "velocities", "tau": "torques"}


def placeholder_remedy(
    value: float, channels: Sequence[tuple[str, int]], n: int
) -> tuple[str, str]:
    """Option and argument that read a value as a missing one.

    Parameters
    ----------
    value : float
        As in the columns.
    channels : sequence of (str, int)
        Quantity and joint, from 0, of the columns.
    n : int
        Number of joints.
    """
    if len(set(channels)) == len(CHANNELS) * n:
        names = ["all"]
    else:
        names = []
        for quantity in CHANNELS:
            joints = [k for own, k in channels if own == quantity]
            names += names_in_option(quantity, joints, n)
    return remedy_of("placeholder", dict.fromkeys(names, value))


def in_words(channels: Sequence[tuple[str, int]], n: int) -> str:
    """Channels for a sentence.

    Parameters
    ----------
    channels : sequence of (str, int)
        Quantity and joint, from 0.
    n : int
        Number of joints.

    Examples
    --------
    >>> in_words([("q", 0), ("q", 1), ("dq", 1)], 2)
    'positions of all joints and velocities of joint 2'
    """
    alike: dict[tuple[int, ...], list[str]] = {}
    for quantity, name in CHANNELS.items():
        if joints := tuple(k for own, k in channels if own == quantity):
            alike.setdefault(joints, []).append(name)
    told = []
    for joints, names in alike.items():
        owner = "all joints" if len(joints) == n > 1 else joints_told(k + 1 for k in joints)
        told.append(f"{listed(names)} of {owner}")
    return listed(told)
