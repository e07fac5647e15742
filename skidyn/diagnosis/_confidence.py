# SPDX-License-Identifier: BSD-3-Clause
"""Confidence of a finding: the probability that its effect is right, from generated logs.

It depends on the margin over the best other explanation; on the significance of the effect; on the
remainder on its joints, which is white for noise, and slow if a torque was attributed to a wrong
effect; on the share of the error that it removes, and on whether most of it remains; and on unknown
effects on the same joints. The weights are those of a logistic regression on effects identified in
logs of other seeds (``benchmarks/diagnosis/confidence.py``), kept near round values; those of the
significance and of an error that mostly remains were set with five collections of logs
(``docs/user_guide/diagnosis_measured.rst``). They weigh explanations against each other
(their score); how often the effects with a score were right on further logs gives the confidence
that is stated. The same benchmark prints the reliability on other logs.
"""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._rule import CHANGE_SHARE

#: Weights of the constant, of the margin, of the logarithm of the inflation of the variance by
#: autocorrelation, of the decimal logarithm of the share of the error that is removed.
CONSTANT, MARGIN, CORRELATED, REMOVED = 3.2, 1.8, -1.35, 1.8
#: Weight of every power of ten by which the q-value exceeds one that is beyond doubt. Of 372 names
#: in five collections of logs, 6 of 10 were right with a q-value above 1e-6, .81 between this and
#: 1e-10, .89 down to 1e-20, and .97 below.
WEAK, STRONG = -0.3, 1e-12
#: Weights of an unknown effect on the same joints, of folds that are blocks of time and not
#: recordings, of an equally good kind on other joints, and of an equally good but less simple one
#: on the same joints.
NAMELESS, BLOCKS, ALIKE, EQUALLED = -1.3, -0.5, -2.4, -1.0
#: Weight of an effect in few recordings only, of which only the plain form was tried.
FEW = -0.6
#: Weight of an error that mostly remains on the joint where it was largest: more than this share of
#: the part above the noise, and this multiple of the noise. A third of such effects are right; of
#: seventeen that leave 1.2 to 1.5 times the noise, sixteen are.
STAYS, MOSTLY, ABOVE_NOISE = -2.2, 0.6, 1.5
#: Weight of an effect that the changed formula of another finding would explain
#: (``_constancy.py``): the six of these in the logs of an examiner were wrong.
INSTEAD = -3.5
#: Weight of the decimal logarithm of the share by which an effect would explain more if it changed,
#: relative to that which is material. On robots it was .03 and .19 for two wrong names of a double
#: pendulum, .80 for hysteresis in place of a weight, .58 for gains that nothing else confirms, and
#: at most .02 for what is known or likely (``real_recordings.py``).
CHANGING = -2.0
#: Weight of a suspicion about the signals of its joints, which would be another explanation.
DOUBTED = -1.5
#: Margins between which another explanation of the same joints is equally good or better; one that
#: explains far more acts on other joints, too.
EQUAL, ABOVE = 0.005, 0.1
#: The same where an effect acts in some recordings only: these alone separate the explanations.
EQUAL_IN_SOME = 0.05
#: Twice the log-likelihood that separates two explanations: about 20 to 1.
SEPARATES = 6.0
#: Inflation of the variance by coloured noise; range of the shares of the error.
COLOURED, LEAST, ENOUGH = 1.7, 0.003, 0.3
#: Highest probability that the number of logs used for the weights permits; of an unknown effect,
#: which may be a known one with another formula, of an effect that changes, of one that leaves most
#: of the error, and beside suspicious signals (also the highest score of one that the data cannot
#: separate from another); and that of one that the data cannot separate from another. Of 177 of
#: these with a score of .88, in fourteen collections of logs, 175 were right, since the simpler of
#: the two was named.
MOST, MOST_IN_DOUBT, MOST_WITH_RIVAL = 0.98, 0.88, 0.95
#: The logit of the confidence in a known effect that fits is this constant plus this multiple of
#: the logit of its score. Of 629 of them in fourteen collections of logs (versions 34 to 38), .82
#: of those with a score below .60 were right, .90 up to .75, .88 up to .88, .96 up to .97, and .99
#: above. What does not fit is as likely as its score: on robots, most such names were wrong.
STATED, STATED_SLOPE = 1.1, 0.6


def confidence(
    margin: float,
    inflation: float,
    removed: float,
    *,
    q_value: float = 0.0,
    lead: float = np.inf,
    nameless: bool = False,
    whole_recordings: bool = True,
    alike: bool = False,
    rivalled: bool = False,
    in_some: bool = False,
    few: bool = False,
    stays: bool = False,
    change: float = 0.0,
    instead: bool = False,
    has_name: bool = True,
    calibrate: bool = True,
) -> float:
    """Probability that an effect is identified correctly.

    Parameters
    ----------
    margin : float
        Margin over the best other explanation of the same joints, as a share of its gain.
    inflation : float
        Inflation of the variance by the autocorrelation of the remainder on its joints; 1 if white.
    removed : float
        Largest share of the squared error of a joint that the effect removes.
    q_value : float, default=0.0
        Smallest q-value of a known effect on a joint.
    lead : float, default=inf
        Margin over the best other explanation as twice a log-likelihood.
    nameless : bool, default=False
        Whether an unknown effect remains, or was found, on its joints.
    whole_recordings : bool, default=True
        Whether it was judged on whole held-out recordings.
    alike : bool, default=False
        Whether a kind that acts on other joints explains the data equally well.
    rivalled : bool, default=False
        Whether the data cannot separate it from another explanation of its joints.
    in_some : bool, default=False
        Whether it acts in some recordings only.
    few : bool, default=False
        Whether it acts in few recordings only, and other forms of it were not tried there.
    stays : bool, default=False
        Whether most of the error above the noise remains on its joints (:func:`mostly_stays`).
    change : float, default=0.0
        Share of what it explains by which it would explain more if it, or the friction of its
        joints, changed over the log or with the motion; no formula is exact for a real robot.
    instead : bool, default=False
        Whether another finding would explain most of it if its formula were different.
    has_name : bool, default=True
        Whether it is a known effect.
    calibrate : bool, default=True
        Return how often effects with such a score were right; if False, the score by which the
        rule weighs explanations, at most 0.98.

    Returns
    -------
    float
        At most 0.98; 0.95 if a rival explains the data as well; 0.88 for an unknown effect, for one
        that changes or that the changed formula of another finding would explain, or if most of
        the error remains.
    """
    # Where all known effects leave most of the error, the best of them need not be right.
    logit = CONSTANT + (0.0 if stays else MARGIN * min(max(margin, 0.0), 1.0))
    logit += CORRELATED * float(np.log(max(inflation / COLOURED, 1.0)))
    logit += REMOVED * float(np.log10(min(max(removed, LEAST), ENOUGH) / ENOUGH))
    logit += _weak(q_value) * has_name
    logit += NAMELESS * nameless + BLOCKS * (not whole_recordings)
    logit += STAYS * stays + FEW * few + ALIKE * alike + INSTEAD * instead
    equal = EQUAL_IN_SOME if in_some else EQUAL
    logit += EQUALLED * (rivalled and -ABOVE < margin and (margin < equal or lead < SEPARATES))
    changes = change > CHANGE_SHARE
    logit += CHANGING * float(np.log10(max(change / CHANGE_SHARE, 1.0)))
    fits = has_name and not (stays or changes or instead)
    separated = not rivalled or (margin >= ABOVE and lead >= SEPARATES)
    if not (calibrate and fits):
        return min(MOST if fits and separated else MOST_IN_DOUBT, _probability(logit))
    return min(MOST if separated else MOST_WITH_RIVAL, _probability(STATED + STATED_SLOPE * logit))


def _probability(logit: float) -> float:
    return float(1 / (1 + np.exp(-logit)))


def of_significant(probability: float, q_value: float) -> float:
    """Score of a name without what its weak significance takes off.

    Whether something is there has been tested already.

    Parameters
    ----------
    probability : float
        Score (:func:`confidence` with ``calibrate=False``).
    q_value : float
        The q-value with which it was computed.

    Returns
    -------
    float
    """
    return _moved(probability, -_weak(q_value))


def in_doubt(probability: float) -> float:
    """Confidence of an effect if a check suspects the signals of its joints.

    Parameters
    ----------
    probability : float
        Confidence without the suspicion (:func:`confidence`).

    Returns
    -------
    float
        At most 0.88.
    """
    return min(MOST_IN_DOUBT, _moved(probability, DOUBTED))


def _weak(q_value: float) -> float:
    """Logit that a weak significance takes off a name, not positive."""
    return WEAK * float(np.log10(max(q_value / STRONG, 1.0)))


def _moved(probability: float, logit: float) -> float:
    """A probability with something added to its logit."""
    odds = probability / max(1 - probability, 1e-9) * float(np.exp(logit))
    return odds / (1 + odds)


def mostly_stays(before: Array, after: Array, noise: Array) -> bool:
    """Whether most of the error above the noise remains on the joint where it was largest.

    Parameters
    ----------
    before, after : ndarray of shape (n_joints,), N m or N
        Error of the joints of an effect without and with all findings.
    noise : ndarray of shape (n_joints,), N m or N
        Noise of these joints, including noise correlated in time, which is similar on all joints.

    Returns
    -------
    bool
    """
    above = np.maximum(np.square(before) - np.square(noise), 0.0)
    left = np.maximum(np.square(after) - np.square(noise), 0.0)
    j = int(np.argmax(above / np.maximum(np.square(noise), np.finfo(float).tiny)))
    return bool(left[j] > MOSTLY * above[j] and after[j] > ABOVE_NOISE * noise[j])
