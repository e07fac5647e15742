# SPDX-License-Identifier: BSD-3-Clause
"""Words of the pages and what they mean, for hovering and for the list at the end."""

from __future__ import annotations

MEANINGS = {
    "held-out error": "Root mean square of measured less modelled torque on judged samples, each "
    "predicted by a model that was fitted without the trajectory or the block of time it is from.",
    "noise": "What no model could remove: the scatter of the torque and position sensors. A joint "
    "whose error is like its noise is explained.",
    "residual": "Measured less modelled torque.",
    "judged": "A sample counts while its joint slides: away from rest and from reversals, where "
    "dry friction can take any value up to its limit and no model of sliding can know it. Where "
    "hysteresis was found, samples at reversals count too.",
    "reversal": "A change of the joint's direction, and the moments before and after it.",
    "rest": "The joint does not move: dry friction holds it and can take any value up to its "
    "limit.",
    "slow": "Speeds up to a quarter of the speed that the joint exceeds in 5 % of its motion.",
    "medium": "Speeds between slow and fast.",
    "fast": "Speeds above 70 % of the speed that the joint exceeds in 5 % of its motion.",
    "loaded": "The fifth of the motion with the largest torque.",
    "warm": "The fifth with the highest temperature, or the latest where none is logged.",
    "largest hidden": "An effect of this size or more would have been found; a smaller one may be "
    "there without being seen.",
    "regime": "A part of the motion: rest, reversal, slow, medium, fast; across them, loaded (the "
    "fifth of the motion with the largest torque) and warm (the warmest, or the latest fifth).",
    "95% interval": "Estimated anew with parts of the log left out, the parameter lies in it in "
    "95 of 100 recordings.",
    "rival": "Another effect that explains this recording nearly as well. The motion that is named "
    "with it would tell them apart.",
    "q-value": "Share of false findings to be expected among those reported at this level.",
    "trajectory": "One piece of motion of the log, by the number that the log gives it, or counted "
    "from 1. Errors are held out by whole trajectories where there are enough of them.",
}

#: Words of the page of a fleet alone.
FLEET_MEANINGS = {
    "distance": "A robot's coefficient less that of the others, over the scatter between the "
    "robots.",
    "scatter": "The standard deviation of a coefficient between normal robots, from the median of "
    "the fleet, so that few worn robots do not count.",
    "q-value": MEANINGS["q-value"],
}


def meaning(word: str) -> str:
    """What a word of a page means.

    Parameters
    ----------
    word : str
        A key of ``MEANINGS`` or ``FLEET_MEANINGS``; its first letter may be a capital.

    Returns
    -------
    str
    """
    return {**MEANINGS, **FLEET_MEANINGS}[word[:1].lower() + word[1:]]
