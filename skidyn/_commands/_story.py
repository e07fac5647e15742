# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis on one screen of a terminal: verdict, joints, findings, remaining error."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from skidyn._text import digits, joints_told, listed

#: Most and least columns of a bar, and columns of the name of a joint with its number.
BAR, LEAST, NAME = 24, 12, 28
#: Number of joints for which the location of the error is shown, and of parts of the motion of
#: each.
TOLD, PLACES = 3, 2


def story_lines(
    story: Mapping[str, Any], failures: Sequence[Mapping[str, Any]] = ()
) -> Iterator[str]:
    """Text that ``skidyn diagnose`` prints, the most important first."""
    for doubt in story["doubts"]:
        yield f"Check the log first: {doubt}"
    yield story["headline"] + "."
    if not story["findings"]:
        yield story["text"]
    for note in story["warnings"]:
        yield f"  ! {note}"
    yield ""
    yield from joint_lines(story)
    for k, line in enumerate(story["findings"], 1):
        guess = line.get("guess", False)
        if k == 1 or guess != story["findings"][k - 2].get("guess", False):
            yield ""
            yield "Uncertain, with a confidence below one half" if guess else "What is missing"
        size = f": {line['size']}" if line["size"] else ""
        when = f"; it {line['when']}" if line.get("when") else ""
        yield f"  {k}. {line['what']} on {line['where']}{size}; {line['sure']}{when}"
    yield from where_lines(failures)
    yield from motion_lines(story.get("simulation"))
    yield from servo_lines(story.get("servo_motion"))
    if any(row["speaks"] for row in story["joints"]):
        yield ""
        yield story["left"]


def motion_lines(motion: Mapping[str, Any] | None) -> Iterator[str]:
    """Errors of the simulated motion of every joint; none if no simulation was requested."""
    if motion is None:
        return
    yield ""
    yield motion["heading"]
    names = [_name(row) for row in motion["joints"]]
    width = max(map(len, names), default=5)
    models = ["before", "after"] if motion["added"] else ["before"]
    heads = models if motion["added"] else ["error"]
    cells = "".join(f"{head:>9s}" for head in heads)
    wide = len(cells)
    yield f"  {'':{width}s}{'position':>{wide}s}{'velocity':>{wide + 6}s}{'no forces':>15s}"
    yield f"  {'joint':{width}s}{cells}      {cells}"
    for name, row in zip(names, motion["joints"], strict=True):
        unit = row["unit"]
        place, speed = (
            "".join(f"{digits(row[model][what]):>9s}" for model in models)
            for what in ("position", "velocity")
        )
        coasting = digits(row["without_forces"])
        yield f"  {name:{width}s}{place} {unit:3s}  {speed} {unit + '/s':5s}{coasting:>9s} {unit}"
    if motion["text"]:
        yield f"  {motion['text']}"


def servo_lines(motion: Mapping[str, Any] | None) -> Iterator[str]:
    """Effects identified from the motion of servos; none without a controller."""
    if motion is None:
        return
    yield ""
    yield motion["heading"]
    for line in motion["findings"]:
        yield f"  {line['what']} on {line['where']}: {line['size']}; {line['evidence']}"
    yield f"  {motion['text']}"


def where_lines(failures: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Part of the motion in which each joint exceeds its noise, one line each."""
    if failures:
        yield ""
        yield "Location of the error above the noise"
    apart = [failure for failure in failures if failure["places"]]
    for failure in apart[:TOLD]:
        places = listed(
            [
                f"{p['share_of_excess']:.0%} {p['where']} ({p['share_of_time']:.0%} of the time)"
                for p in failure["places"][:PLACES]
            ]
        )
        yield f"  joint {failure['joint']}: {places}"
    even = sorted(failure["joint"] for failure in failures if not failure["places"])
    if even:
        yield f"  {joints_told(even)}: spread over the whole motion"


def joint_lines(story: Mapping[str, Any]) -> Iterator[str]:
    """A row per joint that exceeds its noise, the worst first; the others in one line."""
    rows = [row for row in story["joints"] if row["speaks"]] or list(story["joints"])
    rows.sort(key=lambda row: -row["ratios"][0] if row["ratios"][0] == row["ratios"][0] else 0.0)
    known = [ratio for row in rows for ratio in row["ratios"] if ratio == ratio]
    largest = max([1.5, *known])
    names = [_name(row) for row in rows]
    width = max(map(len, names), default=5)
    added = bool(story["findings"])
    heads = ["before", "after", "noise"] if added else ["error", "noise"]
    room = min(BAR, shutil.get_terminal_size().columns - width - 9 * len(heads) - 9)
    wide = room >= LEAST
    picture = "   error over noise" if wide else ""
    yield f"  {'joint':{width}s}{''.join(f'{head:>9s}' for head in heads)}{picture}"
    for name, row in zip(names, rows, strict=True):
        values = [row["before"], *([row["after"]] if added else []), row["noise"]]
        cells = "".join(f"{digits(value):>9s}" for value in values)
        drawn = f"   {bar(row['ratios'], largest, room)}" if wide else ""
        worse = "  worse" if row["state"] == "worse" else ""
        yield f"  {name:{width}s}{cells} {row['unit']:3s}{drawn}{worse}"
    if story["quiet"]:
        yield f"  {story['quiet']}"


def _name(row: Mapping[str, Any]) -> str:
    """The name of a joint, shortened if it is long, and its number."""
    name, number = str(row["name"]), f" ({row['joint']})"
    room = NAME - len(number)
    return (name if len(name) <= room else name[: room - 3] + "...") + number


def bar(ratios: Sequence[float], largest: float, width: int = BAR) -> str:
    """Error over noise as a bar: dark after, light before, with a mark at the noise.

    ``largest`` is the ratio at the end of the bar.
    """
    try:
        "█░│".encode(sys.stdout.encoding or "ascii")
        full, light, mark = "█░│"
    except (UnicodeEncodeError, LookupError):
        full, light, mark = "#-|"
    before, after, noise = (
        round(width * min(r, largest) / largest) if r == r else 0 for r in (*ratios, 1.0)
    )
    cells = [full if k < after else light if k < before else " " for k in range(width)]
    cells[min(noise, width - 1)] = mark
    return "".join(cells).rstrip()
