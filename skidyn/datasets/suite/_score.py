# SPDX-License-Identifier: BSD-3-Clause
"""Score of answers that any tool can give, as plain JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._exceptions import SkidynError

if TYPE_CHECKING:
    from sklearn.utils import Bunch

VERDICTS = ("complete", "missing", "unknown")
#: Share of joints and of signals that an answer and the truth must have in common.
SHARED_JOINTS, SHARED_SIGNALS = 0.6, 0.5
#: Quantile of the normal law for an interval of 95 %.
NORMAL = 1.959963984540054


def score_answers(
    truths: Sequence[Mapping[str, Any]], answers: Sequence[Mapping[str, Any]]
) -> Bunch:
    """Compare answers with the hidden effects of the logs of :func:`hidden_effect_suite`.

    A log is ``solved`` if the tool reports no effect where none is hidden, lists the effect first
    where one is hidden, and lists both where there are two. A claim is correct only on the correct
    joints: at least 60 % of the claimed joints are affected, and 60 % of those that the log can
    show are claimed. Claims of one kind on several joints count together. An unknown effect
    requires ``unknown`` and at least half of its signals; an effect of one trajectory requires that
    trajectory. Logs whose effect is below the noise (less than 12 standard errors) are left out,
    except for false claims.

    Parameters
    ----------
    truths : sequence of dict
        ``truth`` of the cases.
    answers : sequence of dict
        One per case: ``{"case": "case_017", "verdict": "complete" | "missing" | "unknown",
        "effects": [{"kind": .., "joints": [from 1], "parameters": {..}, "variables": ["q1", ..],
        "trajectories": [..], "confidence": ..}, ..]}``, most important first; ``parameters``,
        ``variables``, ``trajectories`` and ``confidence`` if they apply. A case without an answer
        counts as silent.

    Returns
    -------
    Bunch
        ``cases``: one dict per case (``solved``, ``false_claims``, ``clean``,
        ``parameter_error``); ``table``: rows of ``group, n, solved, low, high, clean,
        false_claims`` with Wilson intervals of 95 % for ``solved``, by content, by tier and for
        all; ``parameter_error``: median relative error of the scored parameters.

    Raises
    ------
    SkidynError
        An answer to a case that does not exist, two answers to one case, or a verdict or joint
        that cannot be read.

    Examples
    --------
    >>> from skidyn.datasets import score_answers
    >>> truth = {"case": "case_000", "content": "nothing", "tier": "low", "effects": [],
    ...          "detectable": False, "joints_required": []}
    >>> answer = {"case": "case_000", "verdict": "complete", "effects": []}
    >>> score_answers([truth], [answer]).cases[0]["solved"]
    1.0
    """
    from sklearn.utils import Bunch  # a second of imports: only where answers are scored

    by_case = {str(truth["case"]): truth for truth in truths}
    given: dict[str, Mapping[str, Any]] = {}
    for answer in answers:
        name = str(answer.get("case"))
        if name not in by_case:
            raise SkidynError(f"an answer to {name!r}, which is not a case of this suite.")
        if name in given:
            raise SkidynError(f"{name} is answered twice.")
        given[name] = _checked(answer)
    silent: dict[str, Any] = {"verdict": "complete", "effects": []}
    cases = [_score(truth, given.get(name, silent)) for name, truth in by_case.items()]
    errors = [c["parameter_error"] for c in cases if c["parameter_error"] is not None]
    return Bunch(
        cases=cases,
        table=_table(cases),
        parameter_error=float(np.median(errors)) if errors else None,
    )


def wilson_interval(successes: float, n: int) -> tuple[float, float]:
    """95 % confidence interval of a share (Wilson's score interval).

    Parameters
    ----------
    successes : float
        Number of successes.
    n : int
        Number of trials.

    Returns
    -------
    low, high : float
        Bounds; 0 and 1 without trials.

    Examples
    --------
    >>> from skidyn.datasets import wilson_interval
    >>> low, high = wilson_interval(9, 10)
    >>> f"{low:.2f} {high:.2f}"
    '0.60 0.98'
    """
    if n == 0:
        return 0.0, 1.0
    share, square = successes / n, NORMAL**2
    middle = (share + square / (2 * n)) / (1 + square / n)
    half = NORMAL / (1 + square / n) * math.sqrt(share * (1 - share) / n + square / (4 * n * n))
    return max(0.0, middle - half), min(1.0, middle + half)


def _checked(answer: Mapping[str, Any]) -> Mapping[str, Any]:
    name, verdict = answer.get("case"), answer.get("verdict")
    if verdict not in VERDICTS:
        raise SkidynError(f"{name}: verdict {verdict!r}; expected {', '.join(VERDICTS)}.")
    for effect in answer.get("effects") or ():
        joints = effect.get("joints") or ()
        if "kind" not in effect or not all(isinstance(j, int) and j >= 1 for j in joints):
            raise SkidynError(f"{name}: every effect needs a kind and joints from 1; got {effect}.")
    return answer


def _score(truth: Mapping[str, Any], answer: Mapping[str, Any]) -> dict[str, Any]:
    hidden, claims = truth["effects"], _together(answer.get("effects") or ())
    if answer["verdict"] == "unknown" and not claims:
        claims = [{"kind": "unknown", "joints": [], "variables": []}]
    required = set(truth["joints_required"])
    matches = [[_matches(e, c, required) for c in claims] for e in hidden]
    if not hidden:
        solved = float(not claims)
    elif len(hidden) == 1:
        solved = float(bool(claims) and matches[0][0])
    else:
        solved = float(all(any(row) for row in matches))
    false = sum(not any(row[k] for row in matches) for k in range(len(claims)))
    errors = [
        error
        for effect, row in zip(hidden, matches, strict=True)
        for claim, fits in zip(claims, row, strict=True)
        if fits and claim["kind"] == effect["kind"]
        for error in _parameter_errors(effect, claim)
    ]
    return {
        "case": truth["case"],
        "content": truth["content"],
        "tier": truth["tier"],
        "counts": bool(truth["detectable"]) or not hidden,
        "solved": solved,
        "false_claims": false,
        "clean": float(solved == 1 and not false),
        "parameter_error": float(np.median(errors)) if errors else None,
        "truth": [e["kind"] for e in hidden],
        "said": [c["kind"] for c in claims],
    }


def _together(claims: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Claims of one kind on single joints as one claim; unknown ones only with common signals."""
    out: list[dict[str, Any]] = []
    for claim in claims:
        joints, signals = list(claim.get("joints") or ()), list(claim.get("variables") or ())
        new = {
            "kind": claim["kind"],
            "joints": joints,
            "variables": signals,
            "trajectories": claim.get("trajectories"),
            "values": [(tuple(joints), claim.get("parameters") or {})],
            "single": len(joints) == 1,
        }
        for old in out:
            alike = old["kind"] == new["kind"] and old["single"] and new["single"]
            if new["kind"] == "unknown":
                alike = alike and (
                    set(old["variables"]) & set(signals) or old["variables"] == signals
                )
            if alike and old["trajectories"] == new["trajectories"]:
                old["joints"] = sorted({*old["joints"], *joints})
                old["variables"] = sorted({*old["variables"], *signals})
                old["values"] += new["values"]
                break
        else:
            out.append(new)
    return out


def _matches(effect: Mapping[str, Any], claim: Mapping[str, Any], required: set[int]) -> bool:
    if claim["kind"] not in {effect["kind"], *effect["accept"]}:
        return False
    wanted = effect.get("trajectories")
    if wanted is not None and len(wanted) == 1 and list(claim["trajectories"] or ()) != wanted:
        return False
    if not effect["anywhere"]:
        said, true = set(claim["joints"]), set(effect["joints"])
        shown = (required & true) or true
        if not said or len(said & true) < SHARED_JOINTS * len(said):
            return False
        if len(said & shown) < SHARED_JOINTS * len(shown):
            return False
    if effect["kind"] != "unknown" or claim["kind"] != "unknown" or not effect["variables"]:
        return True
    said, true = set(claim["variables"]), set(effect["variables"])
    if true == {"tool position"}:  # or the positions that make it up
        return "tool position" in said or sum(v.startswith("q") for v in said) >= 2
    return len(said & true) >= SHARED_SIGNALS * len(said | true)


def _parameter_errors(effect: Mapping[str, Any], claim: Mapping[str, Any]) -> list[float]:
    """Relative errors of the scored parameters, joint by joint."""
    out = []
    for name in effect["scored_parameters"]:
        true = np.atleast_1d(np.asarray(effect["parameters"][name], float))
        per_joint = len(true) == len(effect["joints"]) and name != "force"
        for joints, values in claim["values"]:
            if values.get(name) is None:
                continue
            said = np.atleast_1d(np.asarray(values[name], float))
            if name == "force":
                if said.shape == true.shape:
                    out.append(float(np.linalg.norm(said - true) / np.linalg.norm(true)))
            elif per_joint and len(said) == len(joints):
                known = dict(zip(effect["joints"], true, strict=True))
                out += [
                    abs(v - known[j]) / abs(known[j])
                    for j, v in zip(joints, said, strict=True)
                    if j in known
                ]
            else:
                out.append(float(abs(said[0] - true[0]) / abs(true[0])))
    return [float(e) for e in out]


def _table(cases: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for what in ("content", "tier"):
        for name in dict.fromkeys(c[what] for c in cases):
            groups[f"{what} {name}"] = [c for c in cases if c[what] == name]
    groups["all"] = list(cases)
    rows = []
    for name, members in groups.items():
        counted = [c for c in members if c["counts"]]
        low, high = wilson_interval(sum(c["solved"] for c in counted), len(counted))
        mean = {
            k: float(np.mean([c[k] for c in counted])) if counted else math.nan
            for k in ("solved", "clean")
        }
        false = float(np.mean([c["false_claims"] for c in members]))
        rows.append(
            {"group": name, "n": len(counted), "low": low, "high": high, "false_claims": false}
            | mean
        )
    return rows
