# SPDX-License-Identifier: BSD-3-Clause
"""Terms of the pages with their meanings, for hovering and for the list at the end."""

from __future__ import annotations

MEANINGS = {
    "held-out error": "Root mean square of measured minus modelled torque on judged samples. "
    "Each sample is predicted by a model that was fitted without its trajectory, or without its "
    "block of time where there are few trajectories.",
    "noise": "The part of the error that no model can remove: the scatter of the torque and "
    "position sensors. A joint whose error is at the noise level is fully explained.",
    "residual": "Measured minus modelled torque.",
    "judged": "A sample is judged while its joint slides, that is, neither at rest nor near a "
    "reversal, where dry friction can take any value up to its limit and no model of sliding can "
    "predict it. Where hysteresis was found, samples at reversals are judged too.",
    "reversal": "A change of the direction of motion of the joint, including the moments before "
    "and after it.",
    "rest": "The joint does not move: dry friction holds it and can take any value up to its "
    "limit.",
    "slow": "Speeds up to a quarter of the speed that the joint exceeds in 5 % of its motion.",
    "medium": "Speeds between slow and fast.",
    "fast": "Speeds above 70 % of the speed that the joint exceeds in 5 % of its motion.",
    "loaded": "The fifth of the motion with the largest torque.",
    "warm": "The fifth of the motion with the highest temperature, or the last fifth where no "
    "temperature is logged.",
    "largest hidden": "An effect of this size or larger would have been found; a smaller one may "
    "be present but undetected.",
    "regime": "A part of the motion: rest, reversal, slow, medium or fast; and, independent of "
    "these, loaded (the fifth of the motion with the largest torque) and warm (the warmest "
    "fifth, or the last one).",
    "95% interval": "An interval that contains the true value in 95 of 100 recordings. It is "
    "computed from estimates with parts of the log left out.",
    "rival": "Another effect that explains this recording nearly as well. The motion stated with "
    "it would separate the two.",
    "position error": "Root mean square of simulated minus logged position, along recordings that "
    "were left out of the fit of the model.",
    "without forces": "A model that keeps the initial velocity of a piece. A model that is "
    "useful for simulation must have a smaller error.",
    "q-value": "Expected share of false findings among all findings reported at this level.",
    "p-value": "Probability of a change of the error that is at least as large, if the torque does "
    "not depend on the signal.",
    "trajectory": "One piece of motion of the log, with its number in the log, or counted from "
    "1. Errors are held out by whole trajectories if there are enough of them.",
}

#: Terms that occur only on the page of a fleet.
FLEET_MEANINGS = {
    "distance": "The coefficient of a robot minus that of the others, divided by the scatter "
    "between robots.",
    "scatter": "The standard deviation of a coefficient between normal robots, estimated by "
    "medians over the fleet and therefore insensitive to a few worn robots.",
    "q-value": MEANINGS["q-value"],
}


def meaning(word: str) -> str:
    """Meaning of a term of a page; its first letter may be a capital."""
    return {**MEANINGS, **FLEET_MEANINGS}[word[:1].lower() + word[1:]]
