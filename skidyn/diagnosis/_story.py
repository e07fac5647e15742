# SPDX-License-Identifier: BSD-3-Clause
"""The first screen of a diagnosis: location, effect, confidence and error reduction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._text import (
    digits,
    fall,
    inside,
    interval_told,
    joints_told,
    listed,
    raised,
    times,
    trajectories_told,
)
from skidyn.diagnosis._failures import FAILS
from skidyn.diagnosis._findings import course_told, rival_title, sites_told, spans_told
from skidyn.diagnosis._hypothesis import UNKNOWN
from skidyn.diagnosis._rule import GUESS
from skidyn.diagnosis._servo_motion import servo_motion_told
from skidyn.effects import get_effect
from skidyn.measurement import names_in_doubt

if TYPE_CHECKING:
    from skidyn.diagnosis._findings import Finding
    from skidyn.diagnosis._result import Diagnosis

#: Difference of the confidence between joints that is told.
NOTICED = 0.05
#: Mark of a complete model.
SOUND = "✓"
#: A relative change of an error below this counts as none.
SAME = 0.02
#: Confidence below which a finding is doubtful.
SURE = 0.9
#: Parameters that the sentence has in other words.
UNTOLD = ("trajectories", "trajectory")
#: Number of parameters in one line, by the number of joints with separate ones.
TOLD = {1: 3, 2: 2, 3: 1}
#: Number of joints whose sizes are shown in one line.
LISTED = 2
#: Check of the scale of torques: at another one, noise and friction of joints mean nothing.
OF_SCALE = "torque_scale"
#: Most findings in a headline.
SHORT = 2


def story(diagnosis: Diagnosis) -> dict[str, Any]:
    """Content of a diagnosis for the first screen, the command line and a notebook.

    Parameters
    ----------
    diagnosis : Diagnosis
        From :func:`skidyn.diagnosis.diagnose`.

    Returns
    -------
    dict
        ``mark`` and ``headline`` of the verdict, ``text`` below it, ``findings`` in one line per
        kind (``what``, ``where``, ``size``, ``sure``, ``change``, ``when``), ``cards`` with the
        same for every finding, ``joints`` (a row each, with ``speaks`` if it exceeds its noise),
        ``quiet`` (a sentence on the others) and ``left`` (a sentence on the remaining error),
        ``doubts`` (suspicions about the log, to be checked before a finding is accepted) and other
        ``warnings``; ``servo_motion`` with effects from the motion of servos.
    """
    rows = joint_rows(diagnosis)
    cards = [_line(diagnosis, k, rows) for k in range(len(diagnosis.findings))]
    mark, headline, text = _verdict(rows, cards, diagnosis.noise_is_coloured)
    doubts = [str(check) for check in diagnosis.checks if check.certainty == "suspected"]
    if mark == SOUND and _decisive(diagnosis):
        headline = "No effect is judged until this doubt about the log is resolved"
    motion = servo_motion_told(diagnosis.servo_motion, diagnosis.findings)
    if motion is not None and motion["findings"]:
        shown = listed([*map(_what_and_where, motion["findings"])])
        told = headline if cards or mark != SOUND else f"{headline} in the torque"
        headline = f"{told}; the motion of the servos shows {shown}"
        mark = "!" if mark == SOUND else mark
    return {
        "verdict": diagnosis.verdict,
        "mark": "?" if doubts else mark,
        "headline": headline,
        "text": text,
        "findings": _grouped(cards),
        "cards": cards,
        "joints": rows,
        "quiet": _quiet(rows),
        "left": _left(diagnosis, rows),
        "doubts": doubts,
        "warnings": [note for note in diagnosis.warnings if note not in doubts],
        "servo_motion": motion,
    }


def _decisive(diagnosis: Diagnosis) -> bool:
    """Whether a doubt about the log could hide an effect, be one, or is about all torques."""
    certain = any(check.certainty == "certain" for check in diagnosis.checks)
    of_scale = any(c.check == OF_SCALE and c.certainty != "noted" for c in diagnosis.checks)
    return certain or of_scale or bool(names_in_doubt(diagnosis.checks))


def joint_rows(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """One row per joint: held-out error on judged samples before and after, and the noise.

    Parameters
    ----------
    diagnosis : Diagnosis
        From :func:`skidyn.diagnosis.diagnose`.

    Returns
    -------
    list of dict
        ``joint`` (from 1), ``name``, ``unit``, ``before``, ``after``, ``noise``, ``ratios`` (of
        before and after to the noise), ``state`` (``"fails"``, ``"better"``, ``"worse"`` or
        ``"quiet"``), ``material`` (the remaining error exceeds that of a healthy robot), ``speaks``
        and ``text``.
    """
    parts = diagnosis.parts
    found = {joint for finding in diagnosis.findings for joint in finding.joints}
    rows = []
    values = zip(
        diagnosis.joint_names, diagnosis.comparison.units,
        diagnosis.rmse_before, diagnosis.rmse_after, diagnosis.noise, strict=True,
    )  # fmt: skip
    for j, (name, unit, before, after, noise) in enumerate(values, 1):
        floor = max(float(noise), 1e-300) if np.isfinite(noise) else np.nan
        worse = after > (1 + SAME) * before
        better = after < (1 - SAME) * before
        state = "worse" if worse else "better" if better else "quiet"
        if state == "quiet" and before > FAILS * floor:
            state = "fails"
        rows.append(
            {
                "joint": j,
                "name": name,
                "unit": unit,
                "before": float(before),
                "after": float(after),
                "noise": float(noise),
                "ratios": [float(before / floor), float(after / floor)],
                "state": state,
                "material": bool(parts.material[j - 1]) if parts is not None else False,
                "speaks": bool(worse or before > FAILS * floor or j in found),
                "text": fall(before, after, noise, unit, bool(diagnosis.findings)),
            }
        )
    return rows


def _verdict(
    rows: Sequence[dict[str, Any]], cards: Sequence[dict[str, Any]], coloured: bool
) -> tuple[str, str, str]:
    """Mark, headline and text of the banner."""
    material = [row["joint"] for row in rows if row["material"]]
    lines = _grouped(cards)
    if lines:
        guesses = [line for line in lines if line["guess"]]
        told = [line for line in lines if not line["guess"]]
        nameless = [line for line in told if line["kind"] == UNKNOWN]
        mark = "?" if nameless or material else "!"
        text = (
            f"The effect of adding {'it' if len(lines) == 1 else 'them'} on the held-out error is "
            "shown below."
        )
        open_ends = (
            f"; part of the error on {where(material, len(rows))} is not explained"
            if material
            else ""
        )
        best = max(told or lines, key=lambda line: line["fell"])
        top = _what_and_where(best)
        if not told:
            joints = sorted({joint for line in lines for joint in line["joints"]})
            text = f"An effect is missing on {joints_told(joints)}; most likely: {top}{open_ends}"
            more = "No effect is certain; a recording with more or different motion could decide."
            return "?", text, more
        if len(lines) <= SHORT:
            perhaps = f"; possibly {listed([*map(_what_and_where, guesses)])}" if guesses else ""
            return (
                mark,
                f"Missing: {listed([*map(_what_and_where, told)])}{perhaps}{open_ends}",
                text,
            )
        if guesses:
            verb = "is uncertain" if len(guesses) == 1 else "are uncertain"
            open_ends = f"; {len(guesses)} more {verb}{open_ends}"
        what = _counted(len(told) - len(nameless), len(nameless))
        missing = (
            f"{what} is missing:" if len(told) == 1 else f"{what} are missing, the largest being"
        )
        return mark, f"{missing} {top}{open_ends}", text
    if material:
        return (
            "?",
            f"An unknown effect is missing on {joints_told(material)}",
            "The error there is much larger than the noise, and no effect of the catalogue "
            "explains it.",
        )
    if coloured:
        text = (
            "The held-out error is about the same multiple of the fast noise on every joint, as "
            "for torque noise that is correlated in time. An effect would be larger on some "
            "joints than on others."
        )
    elif any(row["ratios"][1] > FAILS for row in rows):
        text = (
            "The held-out error exceeds the noise of the sensors, but is small relative to the "
            "torque of the joints, as on healthy robots."
        )
    else:
        text = "The held-out error of every joint is at the noise level."
    return SOUND, "Nothing significant is missing", text


def _counted(known: int, unknown: int) -> str:
    """Numbers of known and of unknown effects, as the beginning of a sentence."""
    what = [f"{known} known effect{'s' if known > 1 else ''}"] if known else []
    if unknown:
        what.append("an unknown effect" if unknown == 1 else f"{unknown} unknown effects")
    counted = listed(what)
    return counted[:1].upper() + counted[1:]


def _what_and_where(line: dict[str, Any]) -> str:
    return f"{_brief(line['what'])} on {line['where']}"


def _brief(title: str) -> str:
    """Title of a finding for a headline: its family if the member is not certain."""
    return inside(title.partition(", best described by ")[0])


def _line(diagnosis: Diagnosis, k: int, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """A finding in one line: effect, joints, size, confidence, and error reduction of its step."""
    finding = diagnosis.findings[k]
    at = _step(diagnosis.history, finding)
    steps = [diagnosis.history[i]["rmse"] for i in ((0, -1) if at is None else (at - 1, at))]
    served = [rows[j - 1] for j in finding.joints]

    def fell(row: dict[str, Any]) -> float:
        before, after = (step[row["joint"] - 1] for step in steps)
        return float((before - after) / row["noise"]) if row["noise"] > 0 else 0.0

    best = max(served, key=fell, default=None)
    change = ""
    if best is not None:
        before, after = (step[best["joint"] - 1] for step in steps)
        change = fall(before, after, best["noise"], best["unit"])
        change = change if len(served) == 1 else f"joint {best['joint']}: {change}"
    if is_setting(finding):  # the errors of all steps are those of the torque with it
        best, change = (
            None,
            f"it removes {finding.error_drop:.0%} of the squared error of the torque",
        )
    shown, weights = _parameters(finding)
    share = confidence(finding)
    share = 1.0 if share is None else share
    return {
        "kind": finding.kind,
        "card": k + 1,
        "joints": list(finding.joints),
        "step": at,
        "fell": 0.0 if best is None else fell(best),
        "what": finding.title,
        "where": where(finding.joints, len(rows)) + _recordings(finding),
        "only": _recordings(finding),
        "when": when_told(finding),
        "size": ", ".join(shown[: _told(finding)]),
        "clear": dict(zip(shown, weights, strict=True)),
        "sure": sure(finding),
        "beside": finding.rivals,
        "share": share,
        "doubtful": bool(finding.rivals) or share < SURE,
        "guess": finding.kind != UNKNOWN and share < GUESS,
        "change": change,
    }


def _grouped(cards: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One line for all joints on which one step added one effect; what is uncertain last.

    Joints on which it is more likely wrong than right have a line of their own.
    """
    groups: dict[Any, list[dict[str, Any]]] = {}
    for card in cards:
        alike = (card["kind"], card["step"], card["guess"])
        groups.setdefault(card["card"] if card["step"] is None else alike, []).append(card)
    lines = [group[0] if len(group) == 1 else _together(group) for group in groups.values()]
    return sorted(lines, key=lambda line: bool(line["guess"]))


def _together(group: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """A line for several findings: the first parameter of each, largest gain, confidence."""
    joints = sorted({joint for card in group for joint in card["joints"]})
    best = max(group, key=lambda card: card["fell"])
    at = _first_clear([list(card["clear"].values()) for card in group])
    by_site: dict[str, list[str]] = {}
    for card in sorted(group, key=lambda card: card["joints"]):
        if len(card["clear"]) > at:
            site = f"{joints_told(card['joints'])}{card['only']}"
            by_site.setdefault(site, []).append(list(card["clear"])[at])
    sizes_told = [f"{listed(own)} ({site})" for site, own in by_site.items()]
    more = len(sizes_told) - LISTED
    change = best["change"]
    return {
        **best,
        "card": group[0]["card"],
        "joints": joints,
        "where": joints_told(joints) + (" in some trajectories" if best["only"] else ""),
        "size": ", ".join(sizes_told[:LISTED]) + (f" and {more} more" if more > 0 else ""),
        "sure": _least_sure(group),
        "doubtful": any(card["doubtful"] for card in group),
        "change": change if change.startswith("joint") else f"joint {best['joints'][0]}: {change}",
    }


def _least_sure(group: Sequence[dict[str, Any]]) -> str:
    """Text of the joints that are least sure, and the confidence of those with other rivals.

    If the confidence of these joints differs, it is given as a range.
    """
    least = min(group, key=lambda card: card["share"])
    others = [card for card in group if card["beside"] != least["beside"]]
    if not others or least["share"] > min(card["share"] for card in others) - NOTICED:
        most = max(card["share"] for card in group)
        if most < least["share"] + NOTICED:
            return str(least["sure"])
        low, high = map(_percent, (least["share"], most))
        return str(least["sure"]).replace(f"confidence {low}", f"confidence {low} to {high}", 1)
    alike = [card for card in group if card["beside"] == least["beside"]]
    own, rest = (
        joints_told(sorted({j for c in cards for j in c["joints"]})) for cards in (alike, others)
    )
    share = min(card["share"] for card in others)
    return f"on {rest} confidence {_percent(share)}; on {own} {least['sure']}"


def _first_clear(weights: Sequence[Sequence[float]]) -> int:
    """The first parameter whose interval excludes zero on every joint; else the clearest one."""
    fewest = min(map(len, weights), default=0)
    clear = [min(own[k] for own in weights) for k in range(fewest)]
    if not clear:
        return 0
    return next((k for k, weight in enumerate(clear) if weight > 1), int(np.argmax(clear)))


def _step(history: Sequence[dict[str, Any]], finding: Finding) -> int | None:
    """The step that added a finding; one step may add an effect to several joints."""
    for k, entry in enumerate(history[1:], 1):
        if entry["added"] == finding.kind and set(finding.joints) <= set(entry["joints"]):
            return k
    return None


def is_setting(finding: Finding) -> bool:
    """Whether a finding is a setting of the servo and not a torque of the model."""
    return finding.kind != UNKNOWN and get_effect(finding.kind).of_servo


def confidence(finding: Finding) -> float | None:
    """Confidence of a finding, if the diagnosis has it."""
    value = getattr(finding, "confidence", None)
    return None if value is None else float(value)


def sure(finding: Finding) -> str:
    """Short text of the confidence of a finding."""
    share = confidence(finding)
    family = finding.title.partition(", best described by ")
    named = f" that it is {inside(family[0])}" if family[1] else ""
    if finding.elsewhere:
        acts = f"acts on {'this joint' if len(finding.joints) == 1 else 'these joints'}"
        named = f"{named} and {acts}" if named else f" that it {acts}"
    text = "" if share is None else f"confidence {_percent(share)}{named}"
    if finding.elsewhere:
        sites = f"on {sites_told(finding.elsewhere)}, it would explain the data equally well"
        text += f"{'; ' if text else ''}{sites}"
    if finding.rivals:
        rivals = listed([rival_title(kind) for kind in finding.rivals], "or")
        text += f"{'; ' if text else ''}this data cannot separate it from {rivals}"
    elif finding.kind == UNKNOWN:
        text = "no effect of the catalogue explains it"
        if finding.nearest:
            closest, share = rival_title(finding.nearest["kind"]), finding.nearest["share"]
            text += f" fully; {closest} comes closest and removes {share:.0%} as much"
    elif is_setting(finding):
        text = "the torque that the motion requires is the evidence for it"
    elif not text:
        text = "no other effect explains it as well"
    return text


def _percent(share: float) -> str:
    """A confidence in per cent, which is never complete."""
    return f"{min(share, 0.99):.0%}"


def sizes(finding: Finding) -> str:
    """The parameters of a finding with their intervals, ``"k = 3.50 ± 0.40 N m/rad"``."""
    parts = zip(_parameters(finding)[0], _shown(finding).values(), strict=True)
    # a form that was chosen, such as the side of a plane, is no size
    told = [part for part, row in parts if row["unit"] or row["low"] is not None]
    return ", ".join(told[: _told(finding)])


def _told(finding: Finding) -> int:
    """Number of parameters in one line."""
    apart = any(isinstance(row["value"], list) for row in finding.parameters.values())
    return TOLD[min(len(finding.joints), 3) if apart else 1]


def _shown(finding: Finding) -> dict[str, dict[str, Any]]:
    """The parameters that have a text."""
    return {name: row for name, row in finding.parameters.items() if name not in UNTOLD}


def _parameters(finding: Finding) -> tuple[list[str], list[float]]:
    """Text of parameters, and distance of each from zero in half widths of its interval."""
    parts, weights = [], []
    for name, row in _shown(finding).items():
        values = row["value"] if isinstance(row["value"], list) else [row["value"]]
        lows, highs = (
            row[key] if isinstance(row[key], list) else [row[key]] * len(values)
            for key in ("low", "high")
        )
        bounds = list(zip(values, lows, highs, strict=True))
        numbers = [
            v if low is None or low == high else interval_told(v, low, high)
            for v, low, high in bounds
        ]
        told = [digits(v) if isinstance(v, float) else str(v) for v in numbers]
        unit = "" if row["unit"] in ("1", "") else f" {raised(row['unit'])}"
        own = len(told) == len(finding.joints) > 1
        shown = (
            "; ".join(f"{v} (joint {j})" for v, j in zip(told, finding.joints, strict=True))
            if own
            else ", ".join(told)
        )
        parts.append(f"{name} = {shown.replace('-', '−')}{unit}")
        known = [2 * abs(v) / (h - low) for v, low, h in bounds if low is not None and h > low]
        weights.append(max(known, default=0.0))
    return parts, weights


def where(joints: Sequence[int], n_joints: int) -> str:
    """Text of the joints of a finding."""
    return "all joints" if len(joints) == n_joints > 2 else joints_told(joints)


def _recordings(finding: Finding) -> str:
    """Text of the trajectories of a finding that acts in some of them only."""
    return f" in {trajectories_told(finding.trajectories)}" if finding.trajectories else ""


def when_told(finding: Finding) -> str:
    """When a finding acts or how it changes, as a predicate; empty if it always acts alike."""
    if finding.when:
        return spans_told([(e.trajectory, e.start, e.end) for e in finding.when])
    return next(filter(None, map(course_told, finding.terms)), "")


def _quiet(rows: Sequence[dict[str, Any]]) -> str:
    """One sentence on the joints that are at their noise."""
    quiet = [row["joint"] for row in rows if not row["speaks"]]
    if not quiet:
        return ""
    if len(quiet) == len(rows):
        return ""  # the verdict contains it
    return f"The error of {joints_told(quiet)} is at the noise level."


def _left(diagnosis: Diagnosis, rows: Sequence[dict[str, Any]]) -> str:
    """One sentence on the error that the completed model does not explain."""
    left = sorted(
        (row for row in rows if row["ratios"][1] > FAILS), key=lambda row: -row["ratios"][1]
    )
    if not left:
        return "The remaining error of every joint is at the noise level."
    parts = [
        f"{digits(row['after'])} {row['unit']} on joint {row['joint']} "
        f"({times(row['ratios'][1])} the noise)"
        for row in left[:3]
    ]
    others = [row["joint"] for row in left[3:]]
    more = f"; {joints_told(sorted(others))} too" if others else ""
    text = f"Remaining error above the noise: {listed(parts)}{more}."
    if diagnosis.noise_is_coloured:
        text += " It is similar on every joint, as for noise that is correlated in time."
    elif not any(row["material"] for row in rows):
        text += " This is small relative to the torque of the joint, as on healthy robots."
    return text
