# SPDX-License-Identifier: BSD-3-Clause
"""Findings: the missing effects as numbers, texts and curves."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn._text import (
    inside,
    interval_told,
    joints_told,
    listed,
    span_told,
    trajectories_told,
)
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._episodes import Episode
from skidyn.diagnosis._hypothesis import (
    UNKNOWN,
    Hypothesis,
    least_sure,
    removed_share,
    rivals_among,
)
from skidyn.diagnosis._rule import LITTLE
from skidyn.diagnosis._unknown import UnknownTorque
from skidyn.effects import NamelessEffect, Term, get_effect
from skidyn.evidence import Problem

#: Another kind with at least this share of the best one's score is a rival.
RIVAL_SHARE = 0.8
#: A known effect that removes at least this share of what an unknown function removes is told.
NEAREST_SHARE = 0.5
#: Width of its interval, as a share of a parameter, above which another one is told before it.
WIDE = 0.6
#: Points of a curve.
BINS = 40
#: Number of times at which an effect acts that are listed.
LISTED = 4


@dataclass(frozen=True)
class Finding:
    """An effect that the model lacks.

    Parameters
    ----------
    kind : str
        Kind of the catalogue, or ``"unknown"`` for an effect that is not in the catalogue.
    title : str
        Title of the effect.
    joints : tuple of int
        Joints, counted from 1: one, a pair, or all that a tool reaches.
    parameters : dict
        ``{name: {"value", "low", "high", "unit"}}``, numbers with 95 % intervals.
    variables : tuple of str
        Signals that an unknown effect depends on.
    error_drop : float
        Share of the held-out squared error on these joints that adding it removes.
    q_value : float or None
        False-discovery rate at which it was accepted: its p-value times the number of candidates.
        None for limits of servos, which are judged by the error that they remove.
    rivals : tuple of str
        Kinds from which this data cannot separate it.
    separating_motion : str
        Motion that would separate them.
    sentence : str
        The finding as a sentence.
    code : str
        Line of Python that adds it.
    terms : tuple of Term
        Terms to add to a model; none for settings of servos, which change the torque.
    margin : float
        Margin over the best other explanation of the same joints, as a share of its gain; negative
        if a simpler effect was preferred.
    confidence : float or None
        Probability that the effect is identified correctly.
    trajectories : tuple of int or None
        Recordings with the effect; None if all have it.
    when : list of Episode
        Intervals of time of an intermittent torque, and of an effect that begins or ends within
        recordings, in these.
    curves : list of dict
        Effect and partial residual against its main signal, for each joint.
    alike : bool
        Whether a kind that acts on other joints explains the data equally well.
    elsewhere : tuple of tuple of int
        Other joints or pairs of joints, counted from 1, on which the same effect explains the data
        equally well.
    change : float
        Squared error that the effect, or the friction of its joints, would remove in addition if it
        changed over the log or with the motion, as a share of what it removes; 0 if no change is
        significant.
    instead : str or None
        Kind of another finding that would explain most of this one if its formula were different.
    nearest : dict or None
        ``{"kind", "share"}`` of the known effect that comes closest to an unknown torque, and the
        share of the error removed by the unknown torque that it removes alone; None if that is
        less than half.
    lead : float
        The margin as twice a log-likelihood.
    averaged_drop : float or None
        As ``error_drop``, of the torque averaged over windows of motion, without the noise that is
        faster than these.
    score : float or None
        The weight by which the rule compares it with other explanations, between 0 and 1.

    Examples
    --------
    >>> finding = diagnosis.findings[0]  # doctest: +SKIP
    >>> finding.kind, finding.joints, finding.parameters["vs"]["value"]  # doctest: +SKIP
    ('stribeck', (2,), 0.071)
    """

    kind: str
    title: str
    joints: tuple[int, ...]
    parameters: dict[str, dict[str, Any]]
    variables: tuple[str, ...]
    error_drop: float
    q_value: float | None
    rivals: tuple[str, ...]
    separating_motion: str
    sentence: str
    code: str
    terms: tuple[Term, ...]
    margin: float = 1.0
    confidence: float | None = None
    trajectories: tuple[int, ...] | None = None
    when: list[Episode] = field(default_factory=list)
    curves: list[dict[str, Any]] = field(default_factory=list, repr=False)
    alike: bool = False
    elsewhere: tuple[tuple[int, ...], ...] = ()
    change: float = 0.0
    instead: str | None = None
    nearest: dict[str, Any] | None = None
    lead: float = np.inf
    averaged_drop: float | None = None
    score: float | None = None

    def _repr_html_(self) -> str:
        from skidyn.diagnosis._notebook import finding_card

        return finding_card(self)

    def to_dict(self) -> dict[str, Any]:
        """As in the report file.

        Returns
        -------
        dict
            One entry of ``effects``.
        """
        return {
            "kind": self.kind,
            "joints": list(self.joints),
            "parameters": self.parameters,
            "variables": list(self.variables),
            "error_drop": self.error_drop,
            "averaged_drop": self.averaged_drop,
            "q_value": self.q_value,
            "rivals": list(self.rivals),
            "separating_motion": self.separating_motion,
            "elsewhere": [list(joints) for joints in self.elsewhere],
            "margin": self.margin,
            "confidence": self.confidence,
            "change": self.change,
            "instead": self.instead,
            "nearest": self.nearest,
            "trajectories": None if self.trajectories is None else list(self.trajectories),
            "acts": (self.terms[0].when or None) if self.terms else None,
            "form": (self.terms[0].form or None) if self.terms else None,
            "when": [episode.to_dict() for episode in self.when],
            "sentence": self.sentence,
        }


def rivals_of(best: Hypothesis) -> tuple[str, ...]:
    """Kinds that explain nearly as much on the same joints as the added one."""
    own, least = set(best.joints), RIVAL_SHARE * best.score
    near = [h.kind for h in best.others if h.score >= least and own & set(h.joints)]
    return tuple(dict.fromkeys(near))


def nearest_of(problem: Problem, best: Hypothesis) -> dict[str, Any] | None:
    """The known effect that comes closest to an unknown torque, without being a rival.

    Parameters
    ----------
    problem : Problem
        Rows of the log.
    best : Hypothesis
        The unknown torque, with the explanations of other kinds in its ranking.

    Returns
    -------
    dict or None
        As in :class:`Finding`.
    """
    if best.kind != UNKNOWN or best.torque is not None:
        return None

    def removed(hypothesis: Hypothesis) -> Array:
        return removed_share(hypothesis.gain, problem.rows.counts)[list(best.joints)]

    whole, told = removed(best), rivals_of(best)
    shares = {
        other.kind: float(np.minimum(removed(other), whole).sum() / max(whole.sum(), 1e-300))
        for other in reversed(rivals_among(best, best.others))  # the best of a kind stays
        if other.kind not in told
    }
    kind = max(shares, key=lambda k: shares[k], default="")
    return {"kind": kind, "share": shares[kind]} if shares.get(kind, 0) >= NEAREST_SHARE else None


def make_finding(
    problem: Problem,
    hypothesis: Hypothesis,
    candidate: Candidate,
    q_value: float,
    error_drop: float,
    averaged_drop: float,
    intervals: dict[Term, dict[str, Any]],
    unknowns: Sequence[UnknownTorque] = (),
) -> Finding:
    """Make a finding from one term of a hypothesis.

    Parameters
    ----------
    problem : Problem
        Signals of the log.
    hypothesis : Hypothesis
        The added hypothesis.
    candidate : Candidate
        One of its terms.
    q_value, error_drop, averaged_drop : float
        Significance, and share of the squared error of samples and of averaged rows removed.
    intervals : dict
        Parameters of every term with their intervals.
    unknowns : sequence of UnknownTorque, default=()
        Results for unknown terms.
    """
    term, effect = candidate.term, candidate.term.effect
    compared = least_sure(hypothesis, candidate.joints)
    rivals = tuple(dict.fromkeys([*rivals_of(hypothesis), *rivals_of(compared)]))
    joints = _joints(problem, hypothesis, candidate)
    unknown = hypothesis.kind == UNKNOWN
    tested = tuple(sorted({v for u in unknowns for v in u.variables}))
    # None as well for what acts in every recording, with a size of its own
    some = term.trajectories
    some = None if some is not None and len(some) == len(problem.rows.recordings) else some
    formulas = {u.joint: u.proposal for u in unknowns if u.proposal is not None}
    finding = Finding(
        hypothesis.kind,
        _title(candidate, unknown, tested or candidate.variables, rivals),
        joints,
        {} if unknown else _parameters(problem, candidate, intervals),
        tested or candidate.variables,
        error_drop,
        q_value,
        rivals,
        effect.separating_motion,
        "",
        _code(hypothesis.kind, term, joints, list(formulas)),
        (term,),
        compared.margin,
        None,
        some,
        alike=hypothesis.alike,
        elsewhere=tuple(tuple(j + 1 for j in site) for site in hypothesis.elsewhere),
        nearest=nearest_of(problem, hypothesis),
        lead=compared.margin * compared.score,
        averaged_drop=averaged_drop,
    )
    texts = {joint: proposal.text for joint, proposal in formulas.items()}
    return replace(finding, sentence=_sentence(finding, texts))


def _title(
    candidate: Candidate, unknown: bool, variables: Sequence[str], rivals: Sequence[str]
) -> str:
    """Name of an effect with its family, or of an unknown torque by its signals."""
    effect, title = candidate.term.effect, candidate.term.effect.title
    if unknown:
        own = effect.words(candidate.term.shape) if isinstance(effect, NamelessEffect) else ""
        title = own or f"Unknown torque that depends on {listed(variables)}"
    relatives = [k for k in rivals if k != UNKNOWN and get_effect(k).family == effect.family]
    if effect.family and relatives:
        return f"{effect.family.capitalize()}, best described by {title}"
    return title


def _code(kind: str, term: Term, joints: Sequence[int], with_formula: Sequence[int]) -> str:
    """Line of Python that completes the model with a finding."""
    if with_formula:
        return f'model = diagnosis.add("formula", joints={list(with_formula)})'
    if term.trajectories is not None or term.course:
        return "model = diagnosis.model"
    return f'model = diagnosis.add("{kind}", joints={list(joints)})'


def _sentence(finding: Finding, formulas: Mapping[int, str]) -> str:
    """What is said of a finding; ``formulas`` are equivalent ones by joint."""
    (term,) = finding.terms
    shapes = {shape.name for shape in term.effect.shapes}
    told = told_briefly(
        finding.title, finding.joints, finding.trajectories, finding.parameters, shapes
    )
    sentence = f"{told}. "
    sentence += f"It {spans_told(term.spans)}. " if term.spans else ""
    sentence += f"It {course_told(term)}. " if term.course else ""
    sentence += _fall_told(finding.error_drop, finding.averaged_drop)
    if finding.rivals:
        motion = finding.separating_motion
        rivals = listed([rival_title(k) for k in finding.rivals], "or")
        would = f"; a recording with {motion} would" if motion else ""
        sentence += f" This data cannot separate it from {rivals}{would}."
    if finding.elsewhere:
        sites = sites_told(finding.elsewhere)
        sentence += f" It would explain the data equally well on {sites}."
    if finding.nearest:
        sentence += (
            f" Of the known effects, {rival_title(finding.nearest['kind'])} comes closest: alone, "
            f"it removes {finding.nearest['share']:.0%} of the error that this torque removes."
        )
    for joint, text in formulas.items():
        sentence += f" An equivalent formula for joint {joint}: {text}."
    return " ".join([sentence, *notes(finding.kind, finding.parameters)])


def sites_told(sites: Sequence[Sequence[int]]) -> str:
    """Text of joints and pairs of joints for a sentence."""
    return listed(list(map(joints_told, sites)), "or")


def _joints(problem: Problem, hypothesis: Hypothesis, candidate: Candidate) -> tuple[int, ...]:
    if hypothesis.kind == "payload":
        return (candidate.term.shape.get("link", problem.n_joints - 1) + 1,)
    return tuple(sorted(j + 1 for j in candidate.joints))


def notes(kind: str, parameters: Mapping[str, dict[str, Any]]) -> list[str]:
    """Notes on a finding other than its effect, size and rivals."""
    if kind == UNKNOWN:
        return []
    effect = get_effect(kind)
    caveat = f"Note that {effect.caveat}." if effect.caveat else ""
    return [sentence for sentence in (caveat, effect.meaning(parameters)) if sentence]


def rival_title(kind: str) -> str:
    """Title of a kind for a sentence."""
    return "an unknown effect" if kind == UNKNOWN else inside(get_effect(kind).title)


def _parameters(
    problem: Problem, candidate: Candidate, intervals: dict[Term, dict[str, Any]]
) -> dict[str, dict[str, Any]]:
    units = candidate.term.effect.units(bool(problem.signals.prismatic[candidate.joints[0]]))
    table = {}
    for name, found in intervals[candidate.term].items():
        value, low, high = found if isinstance(found, tuple) else (found, None, None)
        table[name] = {"value": value, "low": low, "high": high, "unit": units.get(name, "")}
    return table


def told_briefly(
    title: str,
    joints: tuple[int, ...],
    trajectories: tuple[int, ...] | None,
    parameters: dict[str, dict[str, Any]],
    shapes: Collection[str] = (),
) -> str:
    """Effect, joints, and its first parameter or vector, without a full stop.

    A shape parameter is no size: it is told only in place of sizes that may be zero.
    """
    where = joints_told(joints)
    if trajectories is not None:
        where += f" in {trajectories_told(trajectories)}"
    # the first that is clearly not zero, with the other components of its vector
    rows = sorted(
        parameters.items(), key=lambda item: max(_doubt_of(item[1]), int(item[0] in shapes))
    )
    stem = _stem(rows[0][0]) if rows else ""
    own = [_value(name, row) for name, row in parameters.items() if _stem(name) == stem]
    sizes = ", ".join(filter(None, own))
    return f"{title} on {where}: {sizes}" if sizes else f"{title} on {where}"


def _stem(name: str) -> str:
    """Name of the vector of which a parameter is a component, else its own."""
    stem, _, axis = name.rpartition("_")
    return stem if axis in ("x", "y", "z") else name


def spans_told(spans: Sequence[tuple[int, float, float]]) -> str:
    """When an effect acts that begins or ends within recordings, as a predicate.

    Parameters
    ----------
    spans : sequence of (int, float, float)
        Recording, and time of begin and end in it, s; at least one.
    """
    times = [f"{span_told(start, end)} of trajectory {name}" for name, start, end in spans[:LISTED]]
    more = len(spans) - LISTED
    if more > 0:
        times.append(f"at {more} other time{'s' if more > 1 else ''}")
    return f"acts {listed(times)}"


def course_told(term: Term) -> str:
    """How an effect changes steadily, as a predicate; empty if it does not."""
    if not term.course:
        return ""
    ends = [(first, last) for _, _, first, _, last in term.course]
    each = len(ends) > 1 and ends[0] == ends[1]
    first, last = ends[0] if each else (ends[0][0], ends[-1][1])
    over = "over each recording" if each else "over the log"
    if first < last:
        return f"grows steadily {over}, from {first:.0%} of the stated size"
    return f"falls steadily {over}, from the stated size to {last:.0%} of it"


def beneath_fast_noise(error_drop: float, averaged_drop: float | None) -> bool:
    """Whether next to nothing of the error of samples is removed, but some of that of averages.

    Parameters
    ----------
    error_drop, averaged_drop : float
        As in :class:`Finding`.
    """
    return averaged_drop is not None and error_drop < LITTLE <= averaged_drop


def _fall_told(drop: float, averaged: float | None) -> str:
    if drop <= 0:
        return "Refitting the model with it does not reduce the error on held-out data."
    if not beneath_fast_noise(drop, averaged):
        share = f"{drop:.0%}" if drop >= LITTLE else f"{drop:.1%}"
        return f"Adding it removes {share} of the held-out squared error."
    return (
        f"Adding it removes {averaged:.0%} of the held-out squared error of the torque averaged "
        f"over windows, and {drop:.1%} of that of its samples, which mostly consists of fast noise."
    )


def _doubt_of(row: dict[str, Any]) -> int:
    """2 if the interval of a parameter contains zero, 1 if it is wide or there is none, else 0."""
    value, low, high = row["value"], row["low"], row["high"]
    if not isinstance(value, float) or low is None:
        return 1
    if low <= 0 <= high:
        return 2
    return int(high - low > WIDE * abs(value))


def _value(name: str, row: dict[str, Any]) -> str:
    """Text of a parameter of a finding."""
    value, unit = row["value"], "" if row["unit"] == "1" else f" {row['unit']}".rstrip()
    if isinstance(value, float) and row["low"] is not None:
        return f"{name} = {interval_told(value, row['low'], row['high'])}{unit}"
    return ""


def effect_curves(
    problem: Problem,
    terms: Sequence[Term],
    torque: dict[Term, dict[int, Array]],
    residual: Array,
    variables: Sequence[str] = (),
) -> list[dict[str, Any]]:
    """Effect and partial residual against the effect's main signal, binned.

    Parameters
    ----------
    problem : Problem
        Motion.
    terms : sequence of Term
        Terms of one finding.
    torque : dict of Term to dict of int to ndarray of shape (n_samples,)
        Contribution of each term to the joints that it reaches, N m or N.
    residual : ndarray of shape (n_samples, n_joints)
        Held-out residual of the final model, N m or N.
    variables : sequence of str, default=()
        Signals on which an unknown torque depends.

    Returns
    -------
    list of dict
        ``joint`` (from 1), ``variable``, ``x``, ``effect``, ``measured`` (effect plus residual),
        ``low`` and ``high`` (its quartiles).
    """
    curves = []
    acting = {t: {j: own for j, own in torque[t].items() if np.any(own)} for t in terms}
    for j in sorted({j for own in acting.values() for j in own}):
        own = [t for t in terms if j in acting[t]]
        effect = sum(acting[t][j] for t in own)
        name, x, unit = _main_signal(problem, own[0], j, variables)
        use = problem.rows.sliding[:, j]
        if use.sum() < 5 * BINS:
            continue
        edges = np.quantile(x[use], np.linspace(0, 1, BINS + 1))
        index = np.clip(np.searchsorted(edges, x[use], side="right") - 1, 0, BINS - 1)
        partial = np.asarray(effect)[use] + residual[use, j]
        quartiles = np.array(
            [
                np.quantile(partial[index == b], [0.25, 0.5, 0.75])
                if (index == b).any()
                else [np.nan] * 3
                for b in range(BINS)
            ]
        )
        count = np.maximum(np.bincount(index, minlength=BINS), 1)
        curves.append(
            {
                "joint": j + 1,
                "variable": name,
                "unit": unit,
                "x": np.bincount(index, x[use], BINS) / count,
                "effect": np.bincount(index, np.asarray(effect)[use], BINS) / count,
                "measured": quartiles[:, 1],
                "low": quartiles[:, 0],
                "high": quartiles[:, 2],
            }
        )
    return curves


def _main_signal(
    problem: Problem, term: Term, joint: int, variables: Sequence[str] = ()
) -> tuple[str, Array, str]:
    """Signal against which an effect is plotted: for an unknown torque, one of its variables."""
    s = problem.signals
    usual, at = term.effect.drawn_against, joint
    own = [match for name in variables if (match := re.fullmatch(r"(q|dq|ddq)(\d+)", name))]
    if term.effect.nameless and own and f"{usual}{joint + 1}" not in variables:
        usual, at = own[0][1], int(own[0][2]) - 1
    slides = bool(s.prismatic[at])
    length = "m" if slides else "rad"
    if usual == "temperature" and s.temperature is not None:
        return f"temp{at + 1}", s.temperature[:, at], "°C"
    if usual == "load" and s.load is not None:
        return f"load{at + 1}", s.load[:, at], "N" if slides else "N m"
    if usual in ("q", "dq", "ddq"):
        unit = {"q": length, "dq": f"{length}/s", "ddq": f"{length}/s²"}[usual]
        return f"{usual}{at + 1}", getattr(s, usual)[:, at], unit
    return "time", s.clock, "s"
