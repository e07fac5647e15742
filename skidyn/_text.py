# SPDX-License-Identifier: BSD-3-Clause
"""Texts of numbers, errors, units and joints for users."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Sequence
from itertools import islice

#: Number of names that are compared with a misspelt one, and of their letters, to limit the time.
TRIED, LONGEST_TRIED = 500, 60
#: Difference of the two parts of an interval, as a share of it, from which both ends are stated.
SKEWED = 0.2
#: Titles that begin with the name of a person or a model.
NAMES = ("Coulomb", "Dahl", "LuGre", "Maxwell", "Stribeck")


def fall(before: float, after: float, noise: float, unit: str, added: bool = True) -> str:
    """An error before and after (or before only), with its noise.

    >>> fall(0.6346, 0.1620, 0.1617, "N m")
    '0.63 → 0.16 N m (noise 0.16)'
    """
    steps = " → ".join(digits(x) for x in ((before, after) if added else (before,)))
    return f"{steps} {unit} (noise {digits(noise)})"


def digits(value: float) -> str:
    """Two significant digits, without an exponent for a number of usual size.

    >>> [digits(x) for x in (0.6346, 12.34, 0.0, 3e-7, math.nan)]
    ['0.63', '12', '0', '3e-07', '–']
    """
    if not math.isfinite(value):
        return "–"
    if value == 0 or not 1e-4 <= abs(value) < 1e4:
        return f"{value:.2g}"
    decimals = max(0, 1 - math.floor(math.log10(abs(float(f"{value:.1e}")))))
    return f"{value:.{decimals}f}"


def give_or_take(value: float, half: float) -> str:
    """A value with half its interval, both rounded according to the interval.

    >>> give_or_take(10.534, 0.013), give_or_take(3.5, 0.4), give_or_take(971.2, 316.0)
    ('10.534 ± 0.013', '3.50 ± 0.40', '971 ± 316')
    >>> give_or_take(1.0, math.nan)
    '1.0'
    """
    if not (math.isfinite(value) and math.isfinite(half) and half > 0):
        return digits(value)
    largest = max(abs(value), half)
    if not 1e-4 <= largest < 1e5:
        return f"{value:.3g} ± {half:.2g}"
    decimals = max(0, 1 - math.floor(math.log10(float(f"{half:.1e}"))))
    # The interval may be very narrow: at most five digits of the value are kept.
    decimals = min(decimals, max(0, 4 - math.floor(math.log10(largest))))
    half_text = f"{half:.{decimals}f}" if round(half, decimals) > 0 else f"{half:.1g}"
    return f"{value:.{decimals}f} ± {half_text}"


def times(ratio: float) -> str:
    """Text of a ratio, such as ``"2.1 times"``; beyond a thousand its digits are omitted.

    >>> times(2.13), times(325497.0)
    ('2.1 times', 'more than 1000 times')
    """
    return "more than 1000 times" if ratio > 1000 else f"{digits(ratio)} times"


def raised(unit: str) -> str:
    """Unit with printed powers."""
    return unit.replace("^2", "²").replace("^3", "³")


def inside(title: str) -> str:
    """A title for a sentence; names of people and models keep their capital letter.

    >>> inside("Spring"), inside("Coulomb friction")
    ('spring', 'Coulomb friction')
    """
    return title if title.startswith(NAMES) else title[:1].lower() + title[1:]


def joints_told(joints: Iterable[int | str]) -> str:
    """Text of joints, counted from 1.

    >>> joints_told([1]), joints_told([1, 2, 4])
    ('joint 1', 'joints 1, 2 and 4')
    """
    numbers = [str(j) for j in joints]
    return f"joint{'s' if len(numbers) > 1 else ''} {listed(numbers)}"


def trajectories_told(names: Iterable[int]) -> str:
    """Text of trajectories.

    >>> trajectories_told([3]), trajectories_told([0, 2])
    ('trajectory 3', 'trajectories 0 and 2')
    """
    numbers = [str(name) for name in names]
    return f"trajector{'ies' if len(numbers) > 1 else 'y'} {listed(numbers)}"


def listed(parts: Sequence[str], word: str = "and") -> str:
    """Parts of a sentence, joined by commas and a word before the last one.

    >>> listed(["a", "b"], "or"), listed([])
    ('a or b', '')
    """
    return f" {word} ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else list(parts))


def interval_told(value: float, low: float, high: float) -> str:
    """A value with its interval: half of it, or both ends if they are not equally far.

    >>> interval_told(3.5, 3.1, 3.9), interval_told(17.0, 0.02, 14200.0)
    ('3.50 ± 0.40', '17 (0.020 to 1.4e+04)')
    """
    below, above = value - low, high - value
    if not abs(above - below) > SKEWED * (high - low):
        return give_or_take(value, (high - low) / 2)
    return f"{digits(value)} ({digits(low)} to {digits(high)})"


def measure(name: str, value: object, unit: str = "") -> str:
    """A parameter with its interval, if that is known; the unit ``"1"`` means none.

    >>> measure("k", (3.5, 3.1, 3.9), "N m/rad^2"), measure("n", 3)
    ('k = 3.50 ± 0.40 N m/rad²', 'n = 3')
    """
    if isinstance(value, tuple) and len(value) == 3:
        middle, low, high = value
        text = interval_told(middle, low, high)
    else:
        text = digits(value) if isinstance(value, float) else str(value)
    return f"{name} = {text.replace('-', '−')}{'' if unit in ('', '1') else f' {raised(unit)}'}"


def counted(n: int, noun: str) -> str:
    """A number of things.

    >>> counted(1, "joint"), counted(6, "joint"), counted(1200, "trajectory")
    ('1 joint', '6 joints', '1,200 trajectories')
    """
    if n == 1:
        return f"1 {noun}"
    return f"{n:,} {noun.removesuffix('y')}ies" if noun.endswith("y") else f"{n:,} {noun}s"


def joints_of(n: int) -> str:
    """Numbers of all joints of a robot.

    >>> joints_of(1), joints_of(6)
    ('joint 1', 'joints 1 to 6')
    """
    return "joint 1" if n == 1 else f"joints 1 to {n}"


def suggest(word: object, names: Iterable[str], cutoff: float = 0.6) -> str:
    """Suggestion of a similar name for the end of a message; empty without one.

    >>> suggest("dq_elbw", ["q_elbow", "dq_elbow"])
    " (did you mean 'dq_elbow'?)"
    >>> suggest("weight", ["q1", "q2"])
    ''
    """
    tried = [name for name in islice(names, TRIED) if len(name) <= LONGEST_TRIED]
    close = difflib.get_close_matches(str(word)[:LONGEST_TRIED], tried, n=1, cutoff=cutoff)
    return f" (did you mean {close[0]!r}?)" if close else ""


def span_told(start: float, end: float, digits: int = 1) -> str:
    """A time, or a range of times, in s, with some digits after the point.

    >>> span_told(61.88, 61.92), span_told(7.7, 7.9)
    ('at 61.9 s', 'from 7.7 to 7.9 s')
    """
    first, last = f"{start:.{digits}f}", f"{end:.{digits}f}"
    return f"at {last} s" if first == last else f"from {first} to {last} s"
