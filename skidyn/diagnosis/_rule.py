# SPDX-License-Identifier: BSD-3-Clause
"""The rule for findings: test, variance, level, and withdrawal.

Every explanation of the residual, known or unknown, of all recordings or of some, passes
:meth:`~skidyn.diagnosis._tester.Tester.test` before it becomes a finding (``_acceptance.py``) and
beside each later one (``_reconsideration.py``, ``_withdrawal.py``). All constants of the rule are
in this module; the computation is in ``_tester.py`` (the test), ``_chance.py`` (p-values from few
blocks) and ``_blocks.py`` (blocks of time).

**Test.** The coefficients of one candidate together with all others of the model, all fitted again.
The size and correlation of the residual *with* the candidate are used: a missing smooth torque
makes the residual of the model without it large and correlated, which would hide the torque [1]_.
The same applies to the noise by which joints are weighted if a candidate removes much of a joint's
error; such a candidate is also tested with the remaining noise.

**Variance.** Two p-values are computed, and the larger one is used. The first treats the sums of
the score over blocks of time as independent, with any correlation and variance within a block (a
sandwich estimate by blocks, unbiased if few of them contain most, Hotelling's law for their finite
number [2]_). Blocks are several correlation times long and never cross the border of a trajectory;
each holds the rows of all joints. Its degrees of freedom are those of the blocks in which the
candidate acts [3]_. An effect that acts in one or two blocks, such as a stop that one recording
reaches, would never be significant with these: a tenth of the level (Bonferroni) is kept for a
variance that is moderated by that of the whole residual, as if the latter were known with a few
degrees of freedom [4]_. The second p-value treats the residual as stationary and inflates its
variance by its autocorrelation. The first cannot judge an effect in a single block, the second does
not account for noise that changes; a finding must be significant by both.

**Level.** ``Settings.level`` over all candidates that were tried (Bonferroni): the printed q-value
is the p-value times the number of candidates; for an effect in a part of the recordings also times
the number of parts of that size and of sizes (``_parts.py``).

References
----------
.. [1] W. K. Newey, K. D. West (1987), A simple, positive semi-definite, heteroskedasticity and
   autocorrelation consistent covariance matrix, Econometrica 55(3).
.. [2] R. Ibragimov, U. K. Mueller (2010), t-statistic based correlation and heterogeneity robust
   inference, J. Business & Economic Statistics 28(4); C. B. Hansen (2007), J. Econometrics 141.
.. [3] R. M. Bell, D. F. McCaffrey (2002), Bias reduction in standard errors for linear regression
   with multi-stage samples, Survey Methodology 28(2).
.. [4] G. K. Smyth (2004), Linear models and empirical Bayes methods for assessing differential
   expression, Statistical Applications in Genetics and Molecular Biology 3(1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: Least length of a block in s, and in correlation times of the residual.
SHORTEST_BLOCK, CORRELATION_TIMES = 0.5, 8.0
#: Autocorrelations are added up to this lag in rows, or to the first one below this value.
MOST_LAGS, SMALL = 12, 0.05
#: Number of blocks needed in addition to the tested coefficients; and least number of blocks, in
#: addition to twice the coefficients, for a residual with a long correlation.
FEWEST_BLOCKS, ENOUGH_BLOCKS = 6, 8
#: Share of the level that is kept for effects in few blocks, and degrees of freedom with which the
#: noise of these blocks is assumed to be like that of all (``placebo.py``).
IN_FEW_BLOCKS, LIKE_ELSEWHERE = 0.1, 16.0
#: Cut-off in Hz of the motion along which noisy positions are imitated (``_imitation.py``), and
#: share of what an explanation removes that it must not remove there, too
#: (``nothing_hidden.py --bits 12``).
SLOW_MOTION, IMITATED = 6.0, 0.2
#: Waves per turn from which an unknown function of position cannot represent torque ripple.
RESOLVED = 40.0
#: Waves over the travel of a joint below which a ripple beside a force over its position is an
#: error of the formula of this force.
FEW_WAVES = 4.0
#: Distance of the order of a wave from a whole number within which it is a harmonic of a ripple
#: that was found before.
HARMONIC = 0.03
#: Multiple of the log-likelihood that the best sine gains from which ripple has another form.
NO_SINE = 1.1
#: Rows that a log must have for each coefficient of the model, and those of a joint that the model
#: leaves for each coefficient of an unknown function: with fewer, what is held out is extrapolated.
ROWS_PER_COEFFICIENT = 2
#: A column of which less than this share is new to the model is not tested.
NEW_SHARE = 1e-6
#: Relative rounding error of what a column removes, found from products.
ROUNDING = 1e-6
#: Share of an effect below which a coefficient of the wrong sign is negligible.
NEGLIGIBLE = 0.05
#: A candidate that removes more than this share of the squared error of its joints was weighted by
#: a noise that it mostly caused: unless its p-value is below this, it is tested again with the
#: remaining noise, found in this many rounds.
MASKED, SURE, ROUNDS = 0.3, 1e-9, 3
#: Share of the torque of a coupling on one of its joints that must not be taken back there: what
#: acts on a single joint takes back all of it.
TAKEN_BACK = 0.5
#: Share of what is left on several joints that an effect must remove not to be an error of earlier,
#: imperfect formulas, though the rest is not white (``_acceptance.py``); share of what a load in
#: intervals removes above which it acts on a single joint, and share of the error that an effect
#: with another size in each of many recordings must remove to keep its name (``_ranking.py``).
ALL_LEFT = 0.9
#: Share of the gain of a coupling that must be on joints where it is not small beside what earlier
#: effects removed (``_acceptance.py``).
ON_ONE_OF_TWO = 0.3
#: Share of the error that an explanation must remove beside free functions of the signals of
#: earlier effects, over that without these, not to be an error of their formulas
#: (``_acceptance.py``).
BEYOND_FORMULAS = 0.5
#: Of explanations that the data cannot separate, one is preferred with which the torque of the
#: identified bodies differs from that of the described ones by less than this share of the others.
NEARER = 0.5
#: Share of the recordings with friction, or with an offset, above which it is one of all of them,
#: which changes (``_reconsideration.py``).
IN_MOST = 0.5
#: Twice the difference in log-likelihood below which two exact formulas with equally many numbers
#: have the same torque beside the bodies: e to this half is hardly any evidence.
TWIN = 1.0
#: Viscous or Coulomb friction that the model lacks is added before another effect on its joints if
#: it removes more than this share of the squared error that that removes (``_choice.py``).
FRICTION_SHARE = 0.5
#: A plain formula is not as good as a further form of another effect if it leaves more than this
#: multiple of the squared error: where an effect is much larger than the noise, what its imperfect
#: formula may leave is, too.
STANDS_OUT = 4.0
#: Share of the best score from which other forms of another kind are tried, another pair of joints
#: of a coupling is told with the best one, and another kind may replace a finding beside a later
#: one (``_ranking.py``, ``_acceptance.py``, ``_duels.py``, ``_reconsideration.py``).
NEARLY = 0.9
#: Share of what an effect removes alone on a joint, on the grid of its shapes, from which another
#: one is compared with it there (``_duels.py``).
COMPARABLE = 0.8
#: Share of a recording within which a change at its beginning or end lies between two recordings.
BETWEEN = 0.02
#: Share of an effect in one fold above which the others do not determine it: then parts of
#: recordings are held out instead of whole ones.
CONFINED = 0.8

#: An effect with a lower score that removes a smaller share of the error is not a finding,
#: unless another effect is equally good (``_withdrawal.py``; ``confidence.py``).
GUESS = 0.5
#: Below this score, it is not a finding whatever it removes.
UNLIKELY = 0.02
#: The only finding, if it removes a larger share and only noise is left, is reported as the most
#: likely effect even with a lower score; what removes less has to be likely by itself, also if
#: other explanations are equally good.
MUCH = 0.1
#: An effect that removes a smaller share of the error of samples and of averaged rows is a finding
#: only with this score: in generated logs, such effects with a lower score were wrong
#: (``confidence.py``). The same for an unknown function with this share of the error of samples,
#: since noise of derivatives may cause it; and for an effect that moves the link, whatever its
#: score, since the smoothing of derivatives leaves torques like those of a soft joint
#: (``nothing_hidden.py``).
LITTLE, SURE_OF_LITTLE, LITTLE_OF_DERIVATIVES = 0.005, 0.9, 0.02

#: Squared error, in units of the noise with its correlation, that an explanation must lose where a
#: sum of its coefficients is zero for the sign of this sum to be sure: three standard errors; and
#: the share of what it removes, since an imperfect formula beside bodies that are free needs some.
SURE_SIGN, SURE_SIGN_SHARE = 9.0, 0.05

#: Ratio of the ends of its interval above which the only number of an effect is not determined.
#: Of the names in thirteen collections of logs, one had such an interval, and was wrong.
UNDETERMINED = 30.0

#: An effect that moves the link removes noise of coarse positions if it removes this multiple of
#: the squared error above the noise. True ones remove about as much; no benchmark prints this.
NOISE_REMOVED = 2.0

# Whether an effect is the same throughout the log (``_constancy.py``); ``confidence.py``.
#: Level of all tests of a diagnosis together, number of parts of the recordings, and share of what
#: an effect explains above which its change is material, as ``Settings.further_tolerance``: the
#: formula is not exact, and the change is one of several that are tested.
CHANGE_LEVEL, CHANGE_PARTS, CHANGE_SHARE = 0.001, 8, 0.0075
#: Share of what an effect explains above which the change of another effect may be the reason. In
#: generated logs it was .55 to .76 for effects that are what another formula leaves, and at most
#: .39 for those that are there.
CHANGE_INSTEAD = 0.5

# Effects that begin or end within recordings (``_spans.py``); ``nothing_hidden.py``.
#: Rounds in which coefficients and times are determined in turn, and least number of recordings in
#: which an effect must act, since a single one does not show that it returns or stays, unless it
#: acts on so many joints, whose torques have the ratios of a load.
SPAN_ROUNDS, LEAST_RECORDINGS, JOINTS_OF_LOAD = 8, 2, 3

# Effects that change steadily (``_courses.py``); ``nothing_hidden.py``.
#: Rounds in which coefficients and sizes at the ends are determined in turn.
COURSE_ROUNDS = 4

# Intermittent torques (``_episodes.py``); no false one: ``nothing_hidden.py``.
#: Squared residual, in units of the noise, above which a row counts as excess, and the least sum of
#: the excess of an episode: several successive rows far above quiet ones.
EPISODE_EXCESS, EPISODE_LEAST_SUM = 4.0, 60.0
#: Largest share of a joint's rows in episodes, above which a torque is not intermittent, and least
#: share of its excess in them.
EPISODE_MOST_ROWS, EPISODE_LEAST_EXCESS = 0.4, 0.6
#: Number of successive quiet rows that end an episode.
EPISODE_QUIET = 5
#: Least size of an episode, as a share of the range of the joint's torque, and in units of its
#: noise.
EPISODE_LEAST_RANGE, EPISODE_LEAST_NOISE = 0.01, 2.0
#: Share of the squared residual of a joint that its episodes must contain, since the rest of a
#: torque that depends on the motion is locally large, too.
EPISODE_LEAST_HELD = 0.6
#: Share of a row's weight on sliding samples, since dry friction at reversals is not an episode.
EPISODE_SLIDING = 0.9
#: A force at one link must explain this share of the squared torque of all joints.
EPISODE_FORCE_SHARE = 0.8

#: Share of a squared residual that its values at other times must predict to be called one of time
#: (``_wandering.py``).
WANDERS = 0.5

# When a remainder is material (``_remainder.py``); ``real_recordings.py``, ``nothing_hidden.py``.
#: Times the noise, and share of the torque's range, above which a remainder is material: smoothing
#: and coloured noise leave up to 1.5 times the fast noise, and healthy robots some hundredths of
#: the range.
REMAINDER_TIMES_NOISE, REMAINDER_SHARE_OF_RANGE = 2.0, 0.02
#: Smaller remainders are reported if they are slow: their average over time exceeds this multiple
#: of that of noise, coloured noise included; their autocorrelation inflates the variance of a slow
#: torque more than that of coloured noise; and they reach this share of the range.
REMAINDER_SLOW_TIMES_NOISE, REMAINDER_CORRELATED = 3.0, 2.2
REMAINDER_SLOW_SHARE_OF_RANGE = 0.01
#: Errors that are at most this multiple of the fast noise on every joint, and equal within this
#: factor on all of at least this many joints, are noise that is correlated in time.
COLOURED_MOST, COLOURED_ALIKE, COLOURED_FEWEST_JOINTS = 4.0, 1.5, 3
#: The same factor for errors of averaged rows: a slow torque on one joint makes these unequal even
#: where fast noise of positions is most of the error on all joints.
SLOW_ALIKE = 2.0
#: Share of the torque's range above which something predictable is material if it exceeds noise.
REMAINDER_PREDICTABLE_SHARE = 0.01

# Hysteresis that is visible at reversals only (``_reversals.py``); ``practice.py``.
#: A joint is searched if its error close to reversals is more than this share of its dry friction,
#: which the uncertain velocity there may cause,
REVERSAL_SHARE_OF_FRICTION = 0.12
#: and if its mean squared error there exceeds that of sliding by this factor.
REVERSAL_STANDS_OUT = 2.0
#: Rows at reversals that a joint must have for its error there to be judged, and the share of a
#: row's weight that lies away from them.
REVERSAL_FEWEST_ROWS, REVERSAL_AWAY = 20, 0.6
#: Least share of a joint's squared error that hysteresis must remove there.
REVERSAL_LEAST_SHARE = 0.06

#: A link that swings when a recording begins (``_beginnings.py``): damping ratio and share of the
#: oscillation that determine how long it is left out (gears have ratios of .02 to .1), its
#: resonance, Hz, if none is known yet, share of it below which it is another one, and squared error
#: of the beginnings over that of later motion from which they are left out.
BEGINNING_DAMPING, BEGINNING_LEFT, BEGINNING_RESONANCE = 0.02, float(np.log(10.0)), 9.0
BEGINNING_ALIKE = 0.8
BEGINNING_STANDS_OUT = 2.0

#: Windows, in s, for effects that move the link (``_swift.py``): crossing a play of a few mrad
#: takes as long. They are longer, in periods of the cut-off, where that of coarse positions is low.
SHORT_WINDOW, SHORT_IN_PERIODS = 1 / 32, 0.84


@dataclass(frozen=True)
class Settings:
    """Thresholds of the search, with the same defaults for every robot and effect.

    Parameters
    ----------
    level : float
        Probability of a false finding over all tested candidates.
    least_gain : float
        Twice the gain in held-out log-likelihood, minus the penalty for its parameters, that a
        finding needs: smoothing and coarse positions leave torques that are significant but small.
        An unknown function needs this gain relative to a known effect, and a further form relative
        to the plain one.
    least_share : float
        Share of the held-out squared error of averaged rows that a finding must remove on its
        joints.
    least_drop : float
        Share of the held-out squared error of single samples that it must remove.
    form_tolerance : float
        Share of the squared error removed by an effect that its imperfect formula may leave, a
        tenth of its size. An unknown function that is better by no more than this does not replace
        a known effect, and a later finding that removes no more on the same joints is attributed to
        the earlier ones.
    further_tolerance : float
        The same where a further form of a known effect is compared with an unknown function: it
        was chosen among several.
    exact_tolerance : float
        The same where every formula is exact (:attr:`Effect.is_exact`).
    nameless_tolerance : float
        The same for the residual of an unknown function, whose form only approximates the true one,
        and for the residual that an effect that moves the link leaves to an unknown function.
    alike : float
        Two effects on different joints whose scores differ by less than this share cannot be
        separated by the data.
    simpler_share : float
        A simpler kind is preferred if its score is lower by less than this share.
    family_share : float
        Within a family of effects (hysteresis), the simplest one with this share of the best score
        is preferred; and a member that removes this share of what an unknown function does.
    ripple_share : float
        Torque ripple must reach this share of the score of a function of the signals on averaged
        rows.
    resolved : float
        Multiple of the lower end of the range of a shape parameter that its refined value must
        reach; below, the effect is equivalent to a simpler kind.
    far_end : float
        Share of the upper end of the range of its first shape parameter above which an effect is
        rejected: such a refined value indicates another effect.
    member : float
        Level at which one of several recordings differs, if all together are significant.
    most_recordings : int
        Maximum number of recordings of a joint that may have an effect with individual sizes.
    recordings_share : float
        Effects that differ between more recordings than these have the lowest priority if an effect
        that is equal in all of them explains more than this share.
    white : float
        Inflation of the variance by autocorrelation up to which the remainder is considered white.
    nameless_price : int
        Maximum number of coefficients for which an unknown function is penalised, since its
        held-out error already includes them.
    nameless_tried : int
        Number of functions of the signals from which each tested unknown candidate was selected,
        and of formulas for a further form of a known effect.
    shapes_tested : int
        Number of candidates (joints and shapes) of a kind that are tested before the kind is
        rejected.
    max_findings : int
        Maximum number of added kinds.
    finalists : int
        Kinds compared with noise re-estimated.
    refined : int
        Number of them with refined shape parameters.
    size_share : float
        Least size of a coefficient, as a share of the size implied by its shape
        (:meth:`Effect.bounded`): noise may have the form of an effect, but not its size. For joints
        that oscillate together the size is a third of that for each joint separately, or less.
    size_share_short : float
        The same in short windows, which have more noise. With less than half of the size, the
        torque is explained better without the effect than with its full size.
    repeated : int
        Maximum number of repetitions of a fit whose columns depend on it, as for a saturation.

    Examples
    --------
    >>> Settings(max_findings=1).max_findings
    1
    """

    level: float = 0.001
    least_gain: float = 30.0
    least_share: float = 0.006
    least_drop: float = 0.002
    form_tolerance: float = 0.015
    further_tolerance: float = 0.0075
    exact_tolerance: float = 0.0015
    nameless_tolerance: float = 0.15
    alike: float = 0.005
    simpler_share: float = 0.05
    family_share: float = 0.95
    ripple_share: float = 0.8
    resolved: float = 2.0
    far_end: float = 0.95
    member: float = 0.1
    most_recordings: int = 2
    recordings_share: float = 0.8
    white: float = 2.0
    nameless_price: int = 6
    nameless_tried: int = 20
    shapes_tested: int = 12
    max_findings: int = 4
    finalists: int = 8
    refined: int = 4
    size_share: float = 0.2
    size_share_short: float = 0.5
    repeated: int = 6


def false_discovery_rate(chance: float, n_tests: float) -> float:
    """The printed q-value: the p-value times the number of candidates, at most 1."""
    return min(1.0, chance * max(1, n_tests))
