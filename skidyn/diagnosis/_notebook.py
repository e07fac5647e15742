# SPDX-License-Identifier: BSD-3-Clause
"""The first screen of a diagnosis in a notebook: plain HTML without a script."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from skidyn._text import joints_told
from skidyn.diagnosis._findings import Finding, beneath_fast_noise
from skidyn.diagnosis._story import sizes, sure

BEFORE, AFTER, NOISE = "#c44e00", "#0072b2", "currentColor"


def notebook(story: Mapping[str, Any]) -> str:
    """The first screen as HTML that works in light and dark notebooks.

    Parameters
    ----------
    story : mapping
        From :meth:`skidyn.diagnosis.Diagnosis.story`.

    Returns
    -------
    str
        Every text is escaped.
    """
    parts = [
        f"<p style='font-size:1.15em;margin:0'><b>{escape(story['mark'])} "
        f"{escape(story['headline'])}</b></p>",
    ]
    notes = [*(f"Check the log first: {doubt}" for doubt in story["doubts"]), *story["warnings"]]
    parts += [f"<p style='margin:.2em 0'>⚠ {escape(note)}</p>" for note in notes]
    if story["findings"]:
        parts.append(f"<ol style='margin:.4em 0'>{''.join(map(_finding, story['findings']))}</ol>")
    rows = [row for row in story["joints"] if row["speaks"]]
    if rows:
        ratios = [ratio for row in rows for ratio in row["ratios"] if ratio == ratio]
        largest = max([*ratios, 1.5])
        parts.append(
            "<table><thead><tr><th style='text-align:left'>Joint</th>"
            "<th style='text-align:left'>Error over noise, before and after</th>"
            "<th style='text-align:left'>Held-out error</th></tr></thead><tbody>"
            f"{''.join(_row(row, largest) for row in rows)}</tbody></table>"
        )
    motion = story.get("simulation")
    moved = "" if motion is None else f"{motion['heading']}. {motion['text']}"
    servos = story.get("servo_motion")
    seen = ""
    if servos is not None:
        sentences = [f["sentence"] for f in servos["findings"]]
        seen = " ".join([f"{servos['heading']}.", *sentences, servos["text"]])
    last = [text for text in (story["quiet"], story["left"], moved, seen) if text]
    parts += [f"<p style='margin:.2em 0'>{escape(text)}</p>" for text in last]
    return f"<div>{''.join(parts)}</div>"


def finding_card(finding: Finding) -> str:
    """A finding as HTML: effect, joints, size, confidence, and the line that adds it.

    Parameters
    ----------
    finding : Finding
        From a diagnosis.

    Returns
    -------
    str
        Every text is escaped.
    """
    size, fast = sizes(finding), ""
    if beneath_fast_noise(finding.error_drop, finding.averaged_drop):
        fast = f", and {finding.averaged_drop:.0%} of that of the torque averaged over windows"
    parts = [
        f"<b>{escape(finding.title)}</b> on {escape(joints_told(finding.joints))}"
        f"{': ' + escape(size) if size else ''}",
        f"{escape(sure(finding))}; "
        f"removes {finding.error_drop:.0%} of the squared error there{fast}",
    ]
    if finding.rivals and finding.separating_motion:
        motion = escape(finding.separating_motion)
        parts.append(f"A recording with {motion} would separate them.")
    parts.append(f"<code>{escape(finding.code)}</code>")
    return "".join(f"<p style='margin:.2em 0'>{part}</p>" for part in parts)


def _finding(line: Mapping[str, Any]) -> str:
    size = f": {escape(line['size'])}" if line["size"] else ""
    guess = "Uncertain: " if line["guess"] else ""
    return (
        f"<li>{guess}<b>{escape(line['what'])}</b> on {escape(line['where'])}{size}. "
        f"{escape(line['change'])}; {escape(line['sure'])}.</li>"
    )


def _row(row: Mapping[str, Any], largest: float) -> str:
    def width(ratio: float) -> float:
        return 100 * ratio / largest if ratio == ratio else 0.0

    bars = "".join(
        f"<div style='height:.5em;width:{width(ratio):.1f}%;background:{colour}'></div>"
        for ratio, colour in zip(row["ratios"], (BEFORE, AFTER), strict=True)
    )
    mark = (
        f"<div style='position:absolute;top:0;bottom:0;left:{width(1.0):.1f}%;"
        f"border-left:2px dashed {NOISE}'></div>"
    )
    return (
        f"<tr><td style='text-align:left'>{row['joint']} {escape(row['name'])}</td>"
        f"<td><div style='position:relative;width:16em'>{bars}{mark}</div></td>"
        f"<td style='text-align:left'>{escape(row['text'])}</td></tr>"
    )
