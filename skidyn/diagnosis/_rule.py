# SPDX-License-Identifier: BSD-3-Clause
"""The rule for findings: test, variance, level, and withdrawal.

Every explanation of the residual, known or unknown, of all recordings or of some, passes
:meth:`Tester.test` before it becomes a finding (``_acceptance.py``) and beside each later one
(``_reconsideration.py``, ``_withdrawal.py``).

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

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc
from scipy.stats import t as student

from skidyn._signals import Array
from skidyn.evidence import RIDGE, Felt, Problem, column_sizes, felt_columns, gram_of, products_with

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
SLOW_MOTION, IMITATED = 6.0, 0.3
#: Waves per turn from which an unknown function of position cannot represent torque ripple.
RESOLVED = 40.0
#: Waves over the travel of a joint below which a ripple beside a force over its position is an
#: error of the formula of this force.
FEW_WAVES = 4.0
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
#: imperfect formulas, though the rest is not white (``_acceptance.py``); and share of what a load
#: in intervals removes above which it acts on a single joint (``_ranking.py``).
ALL_LEFT = 0.9
#: Share of the error that an explanation must remove beside free functions of the signals of
#: earlier effects, over that without these, not to be an error of their formulas
#: (``_acceptance.py``).
BEYOND_FORMULAS = 0.5
#: Of explanations that the data cannot separate, one is preferred with which the torque of the
#: identified bodies differs from that of the described ones by less than this share of the others.
NEARER = 0.5
#: Share of the best score from which other forms of another kind are tried, and another pair of
#: joints of a coupling is told with the best one (``_ranking.py``, ``_acceptance.py``).
NEARLY = 0.9
#: Share of a recording within which a change at its beginning or end lies between two recordings.
BETWEEN = 0.02
#: Share of an effect in one fold above which the others do not determine it: then parts of
#: recordings are held out instead of whole ones.
CONFINED = 0.8

#: An effect with a lower confidence that removes a smaller share of the error is not a finding,
#: unless another effect is equally good (``_withdrawal.py``; ``confidence.py``).
GUESS = 0.5
#: Below this confidence, it is not a finding whatever it removes.
UNLIKELY = 0.02
#: The only finding, if it removes a larger share and only noise is left, is reported as the most
#: likely effect even with a lower confidence.
MUCH = 0.1
#: An effect that removes a smaller share of the error of samples is a finding only with this
#: confidence: in generated logs, such effects with a lower confidence were wrong
#: (``confidence.py``).
LITTLE, SURE_OF_LITTLE = 0.005, 0.9

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
#: which an effect must act: a single one does not show that it returns or stays.
SPAN_ROUNDS, LEAST_RECORDINGS = 8, 2

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
#: A joint whose rows lie in effectively fewer than this share of the folds has to be extrapolated
#: where one of these is left out: its remainder is that of the fit to all folds.
SELDOM_SHARE_OF_FOLDS = 0.5
#: Errors that are at most this multiple of the fast noise on every joint, and equal within this
#: factor on all of at least this many joints, are noise that is correlated in time.
COLOURED_MOST, COLOURED_ALIKE, COLOURED_FEWEST_JOINTS = 4.0, 1.5, 3
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
#: takes as long.
SHORT_WINDOW = 1 / 32


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
        is preferred.
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


@dataclass(frozen=True)
class Test:
    """Significance of a candidate in addition to a model.

    Attributes
    ----------
    chance : float
        The larger one of the two p-values.
    coefficients : ndarray of shape (n_coefficients,)
        Coefficients of the candidate, with the model fitted again.
    drop : float
        Squared error removed, in units of the noise.
    """

    __test__ = False

    chance: float
    coefficients: Array
    drop: float


def _any(_: float) -> bool:
    """Every p-value is wanted."""
    return True


class Tester:
    """Tests of candidates in addition to one model.

    Parameters
    ----------
    problem : Problem
        Rows.
    blocks : sequence of dict
        Columns of the model beside the rigid body.
    sigma : ndarray of shape (n_joints,)
        Noise of one row, by which joints are weighted.
    target : sequence of ndarray
        Averaged torque of every joint.

    Attributes
    ----------
    felt : list of Felt
        The model's columns by joint, in units of the noise.
    inverse : ndarray of shape (n_columns, n_columns)
        Inverse of their products.
    residual : list of ndarray of shape (n_rows_j,)
        By joint, in units of the noise.
    """

    def __init__(
        self,
        problem: Problem,
        blocks: Sequence[dict[int, Array]],
        sigma: Array,
        target: Sequence[Array],
    ) -> None:
        self.problem, self.sigma = problem, sigma
        felt, width = felt_columns(problem, blocks, sigma)
        y = [t / s for t, s in zip(target, sigma, strict=True)]
        self._duration = float(sum(problem.rows.spans[1]))
        self._fit(felt, gram_of(felt, width), products_with(felt, dict(enumerate(y)), width), y)

    def _fit(self, felt: list[Felt], gram: Array, right: Array, target: list[Array]) -> None:
        scale = column_sizes(gram)
        normal = gram / scale[:, None] / scale + RIDGE * np.eye(len(scale))
        self.felt, self._gram, self._right, self._target = felt, gram, right, target
        self.inverse = np.linalg.inv(normal) / scale[:, None] / scale
        solution = self.inverse @ right
        self.residual = [t - f.rows @ solution[f.places] for f, t in zip(felt, target, strict=True)]
        self._left = right - gram @ solution  # rounding, and the ridge
        self._square = sum(float(r @ r) for r in self.residual)
        self._free = max(1, int(self.problem.rows.counts.sum()) - len(scale))

    def beside(self, blocks: Sequence[dict[int, Array]]) -> Tester:
        """Tests with the same model and further columns.

        Parameters
        ----------
        blocks : sequence of dict of int to ndarray of shape (n_rows_j, k)
            Averaged columns, per joint they reach.
        """
        wider = copy(self)
        felt, gram, right = list(self.felt), self._gram, self._right
        for block in blocks:
            scaled = self._scaled(block)
            cross = products_with(felt, scaled, len(gram))
            own = np.asarray(sum(rows.T @ rows for rows in scaled.values()))
            along = sum(rows.T @ self._target[j] for j, rows in scaled.items())
            for j, rows in scaled.items():
                felt[j] = felt[j].with_columns(len(gram), rows)
            gram = np.block([[gram, cross], [cross.T, own]])
            right = np.append(right, along)
        wider._fit(felt, gram, right, self._target)
        return wider

    def test(
        self,
        rows: dict[int, Array],
        zeros: NDArray[np.bool_] | None = None,
        significant: Callable[[float], bool] = _any,
    ) -> Test:
        """Test the coefficients of some columns together.

        Parameters
        ----------
        rows : dict of int to ndarray of shape (n_rows_j, n_coefficients)
            Averaged columns, per joint they reach.
        zeros : ndarray of shape (n_coefficients,) of bool, optional
            Coefficients that only define the zero of the effect. The others must be significant in
            addition to them, too: the constant of a spring is no evidence for a spring.
        significant : callable, optional
            Function that returns whether a p-value is small enough. Larger ones are not exact.
        """
        test = self._tested(rows, zeros, significant)
        error = sum(float(self.residual[j] @ self.residual[j]) for j in rows)
        if test.drop > MASKED * error:
            if not significant(test.chance):
                test = self._tested(rows, zeros)
            if SURE < test.chance < 1.0:
                again = self._unmasked(rows)._tested(rows, zeros)
                test = replace(test, chance=min(test.chance, again.chance))
        return test

    def _unmasked(self, rows: dict[int, Array]) -> Tester:
        """Tests with the same model, and joints weighted by the noise that some columns leave."""
        tester = self
        for _ in range(ROUNDS):
            left = tester.beside([rows]).residual
            shares = np.ones(len(left))
            for j in rows:
                shares[j] = np.sqrt(np.mean(left[j] ** 2)) + 1e-100 if len(left[j]) else 1.0
            tester = tester._weighted(shares)
        return tester

    def _weighted(self, shares: Array) -> Tester:
        """Tests with the same model and a multiple of the noise of every joint."""
        other = copy(self)
        other.sigma = self.sigma * shares
        felt = [Felt(f.places, f.rows / x) for f, x in zip(self.felt, shares, strict=True)]
        target = [y / x for y, x in zip(self._target, shares, strict=True)]
        width = len(self._gram)
        other._fit(
            felt, gram_of(felt, width), products_with(felt, dict(enumerate(target)), width), target
        )
        return other

    def _tested(
        self,
        rows: dict[int, Array],
        zeros: NDArray[np.bool_] | None,
        significant: Callable[[float], bool] = _any,
    ) -> Test:
        """As :meth:`test`, with the present noise."""
        scaled = self._scaled(rows)
        mimic = self._mimic(scaled)
        least = self._least(scaled, *mimic)
        if not significant(least.chance):
            return least
        new = self._swept(scaled, mimic[1])
        test = self._test(rows, new, self.residual, significant)
        if zeros is None or not zeros.any() or test.chance == 1.0 or not significant(test.chance):
            return test
        own = {j: block[:, ~zeros] for j, block in rows.items()}
        aside = np.concatenate([z[:, zeros] for z in new])
        both = np.column_stack([np.concatenate(self.residual), *np.concatenate(new)[:, ~zeros].T])
        both -= aside @ np.linalg.lstsq(aside, both, rcond=NEW_SHARE)[0]
        parts = self.problem.rows.split(both)
        columns, left = [part[:, 1:] for part in parts], [part[:, 0] for part in parts]
        alone = self._test(own, columns, left, significant)
        return replace(test, chance=max(test.chance, alone.chance))

    def estimate(self, rows: dict[int, Array]) -> tuple[Array, float]:
        """Coefficients of some columns, and the squared error that they remove.

        Parameters
        ----------
        rows : dict of int to ndarray of shape (n_rows_j, n_coefficients)
            Averaged columns, per joint they reach.
        """
        scaled = self._scaled(rows)
        least = self._least(scaled, *self._mimic(scaled))
        return least.coefficients, least.drop

    def least_difference(self, count: int, width: int) -> tuple[float, int, int]:
        """The two of the last effects of the model whose coefficients differ least.

        Parameters
        ----------
        count, width : int
            Number of these effects, and of columns of each.

        Returns
        -------
        difference : float
            Squared error that separate coefficients remove, in units of the remaining noise.
        first, second : int
            Places of the two among these effects.
        """
        own = slice(len(self.inverse) - count * width, None)
        value = (self.inverse @ self._right)[own].reshape(count, width)
        spread = self.inverse[own, own].reshape(count, width, count, width)
        mean = sum(float(r @ r) for r in self.residual) / self._free
        found = []
        for i, j in combinations(range(count), 2):
            d = value[i] - value[j]
            variance = spread[i, :, i] + spread[j, :, j] - spread[i, :, j] - spread[j, :, i]
            found.append((float(d @ np.linalg.lstsq(variance, d, rcond=None)[0]) / mean, i, j))
        return min(found)

    def test_each(
        self, rows: dict[int, Array], significant: Callable[[float], bool]
    ) -> tuple[Test, Iterator[Test]]:
        """Test some columns together and, if requested, each column alone.

        Parameters
        ----------
        rows : dict of int to ndarray of shape (n_rows_j, n_coefficients)
            Averaged columns, per joint they reach.
        significant : callable
            Function that returns whether a p-value is small enough. Larger ones are not exact, and
            columns that are not significant together are not tested alone.
        """
        scaled = self._scaled(rows)
        mimic = self._mimic(scaled)
        least = self._least(scaled, *mimic)
        if not significant(least.chance):
            return least, iter(())
        new = self._swept(scaled, mimic[1])
        alone = (
            self._test(
                {j: block[:, [c]] for j, block in rows.items()},
                [z[:, [c]] for z in new],
                self.residual,
                significant,
            )
            for c in range(new[0].shape[1])
        )
        return self._test(rows, new, self.residual, significant), alone

    def _test(
        self,
        rows: dict[int, Array],
        new: list[Array],
        residual: Sequence[Array],
        significant: Callable[[float], bool] = _any,
    ) -> Test:
        """Test columns from which the part that the model can represent has been removed."""
        k = next(iter(rows.values())).shape[1]
        own = np.asarray(sum(np.sum((b / self.sigma[j]) ** 2, axis=0) for j, b in rows.items()))
        gram = np.asarray(sum(z.T @ z for z in new))
        # Columns that the model can represent have no information.
        told = gram.diagonal() > np.maximum(NEW_SHARE * own, 0.0)
        if not told.any():
            return Test(1.0, np.zeros(k), 0.0)
        if k > 1:
            new, gram, k = [z[:, told] for z in new], gram[np.ix_(told, told)], int(told.sum())
        size = np.sqrt(gram.diagonal())
        new, gram = [z / size for z in new], gram / size[:, None] / size
        score = np.asarray(sum(z.T @ e for z, e in zip(new, residual, strict=True)))
        b = np.linalg.solve(gram + RIDGE * np.eye(k), score)
        left = [e - z @ b for e, z in zip(residual, new, strict=True)]
        drop = float(score @ b)
        inflation = cache(lambda j: float(variance_inflation(self.problem, [left[j]], [j])[0]))
        # The joint with the largest weight of the column, and the slowest possible column.
        factor = inflation(int(np.argmax([float(np.sum(z**2)) for z in new])))
        mean = max(sum(float(r @ r) for r in left) / self._free, 1e-300)
        chance = _tail(drop / k / factor / mean, k, max(2.0, self._free / factor))
        if significant(chance):  # blocks can only raise it
            largest = max(map(inflation, rows))
            by_blocks = self._by_blocks(new, left, score, factor * mean, largest)
            chance = max(chance, by_blocks)
        coefficients = np.zeros(len(told))
        coefficients[told] = b / size
        return Test(chance, coefficients, drop)

    def _scaled(self, rows: dict[int, Array]) -> dict[int, Array]:
        """Columns in units of the noise."""
        return {j: b / self.sigma[j] for j, b in rows.items()}

    def _mimic(self, scaled: dict[int, Array]) -> tuple[Array, Array]:
        """Products with the model's columns, and its coefficients that approximate some columns."""
        cross = products_with(self.felt, scaled, len(self.inverse))
        return cross, self.inverse @ cross

    def _swept(self, scaled: dict[int, Array], mimic: Array) -> list[Array]:
        """Columns minus the part that the model can represent, on the rows of every joint."""
        return [scaled.get(j, 0.0) - f.rows @ mimic[f.places] for j, f in enumerate(self.felt)]

    def _least(self, scaled: dict[int, Array], cross: Array, mimic: Array) -> Test:
        """The smallest p-value that some columns can have, from products alone.

        That of a white residual: its correlation can only raise the p-value.
        """
        own = np.asarray(sum(b.T @ b for b in scaled.values()))
        score = np.asarray(sum(b.T @ self.residual[j] for j, b in scaled.items()))
        both = cross.T @ mimic
        gram = own - both - both.T + mimic.T @ (self._gram @ mimic)
        score = score - mimic.T @ self._left
        told = gram.diagonal() > np.maximum(NEW_SHARE * own.diagonal(), 0.0)
        coefficients, k = np.zeros(len(told)), int(told.sum())
        if not k:
            return Test(1.0, coefficients, 0.0)
        if k < len(told):
            gram, score = gram[np.ix_(told, told)], score[told]
        size = np.sqrt(gram.diagonal())
        gram, score = gram / size[:, None] / size, score / size
        b = np.linalg.solve(gram + RIDGE * np.eye(k), score)
        coefficients[told] = b / size
        drop = float(score @ b)
        most = drop * (1 + ROUNDING)
        mean = max((self._square - most) / self._free, 1e-300)
        return Test(_tail(most / k / mean, k, self._free), coefficients, drop)

    def _by_blocks(
        self,
        new: list[Array],
        left: list[Array],
        score: Array,
        stationary: float,
        inflation: float,
    ) -> float:
        """P-value of the coefficients for independent scores of blocks.

        Given the variance of the score of an orthonormal column for a stationary residual, and the
        largest inflation of a variance by correlation.
        """
        longest = self._duration / (2 * len(score) + ENOUGH_BLOCKS)
        length = min(block_length(self.problem, inflation), longest)
        block, count = time_blocks(self.problem, length)
        if count < len(score) + FEWEST_BLOCKS:
            return 1.0
        index = np.concatenate(block)
        order = np.argsort(index, kind="stable")
        edges = np.searchsorted(index[order], np.arange(count + 1)).tolist()
        columns, residual = np.concatenate(new)[order], np.concatenate(left)[order]
        parts = [slice(*pair) for pair in pairwise(edges)]
        sums = np.array([columns[rows].T @ residual[rows] for rows in parts])
        grams = np.array([columns[rows].T @ columns[rows] for rows in parts])
        score, sums, share = unbiased_scores(score, sums, grams)
        k, free = len(score), degrees_of_freedom(share)
        own = sums.T @ sums
        many = _hotelling(score, own, free)
        # The moderated variance is mostly a known matrix times a size. The law is then F, without
        # the degrees of freedom that Hotelling's takes for the estimated covariances.
        both = free * own + LIKE_ELSEWHERE * stationary * np.eye(k)
        free += LIKE_ELSEWHERE
        few = _tail(float(score @ np.linalg.solve(both, score)) * free / k, k, free)
        return min(1.0, many / (1.0 - IN_FEW_BLOCKS), few / IN_FEW_BLOCKS)


def _tail(statistic: float, k: float, free: float) -> float:
    """Probability that a value of the F distribution is larger.

    As ``scipy.stats.f.sf``, which spends most of its time on checking the arguments.
    """
    return 1.0 if statistic <= 0 else float(fdtrc(k, free, statistic))


def chance_of_score(score: Array, sums: Array) -> float:
    """P-value of a score with independent sums over blocks (Hotelling's T-squared).

    Parameters
    ----------
    score : ndarray of shape (n_coefficients,)
        Score of the model without the candidate, over all blocks.
    sums : ndarray of shape (n_blocks, n_coefficients)
        Score of every block, with the residual with the candidate.
    """
    count, k = sums.shape
    if count < k + FEWEST_BLOCKS:
        return 1.0
    free = count - 1
    return _hotelling(score, sums.T @ sums * count / free, free)


def _hotelling(score: Array, variance: Array, free: float) -> float:
    """P-value of a score whose variance is an estimate with some degrees of freedom."""
    k = len(score)
    variance = variance + 1e-12 * np.trace(variance) * np.eye(k)
    wald, rest = float(score @ np.linalg.solve(variance, score)), free - k + 1
    return _tail(wald * rest / (k * free), k, rest) if rest > 0 else 1.0


def degrees_of_freedom(share: Array) -> float:
    """Degrees of freedom of the variance from blocks with some shares of the information.

    Twice the squared expectation of the sum of squares of :func:`unbiased_scores` over its
    variance, for independent rows. Several coefficients have one number: that for their mean share.

    Parameters
    ----------
    share : ndarray of shape (n_blocks, n_coefficients, n_coefficients)
        Of every block, for orthonormal columns.

    Returns
    -------
    float
        The number of blocks less one if all have equal shares, fewer if some have more.
    """
    h = np.trace(share, axis1=1, axis2=2) / share.shape[1]
    between = np.sort(h**2 / np.maximum(1.0 - h, RIDGE))
    # Products of different blocks, smallest first: one block may hold nearly everything.
    pairs = 2.0 * float(between[1:] @ np.cumsum(between)[:-1])
    return 1.0 / (float(h @ h) + pairs)


@lru_cache(maxsize=4096)
def least_significant(level: float, free: float) -> float:
    """Size of one coefficient, in standard errors, from which blocks find it significant.

    Parameters
    ----------
    level : float
        Largest p-value.
    free : float
        Degrees of freedom of the blocks in which it acts.

    Returns
    -------
    float
    """
    many = student.isf((1.0 - IN_FEW_BLOCKS) * level / 2, free)
    few = student.isf(IN_FEW_BLOCKS * level / 2, free + LIKE_ELSEWHERE)
    return float(min(many, few))


def unbiased_scores(score: Array, sums: Array, grams: Array) -> tuple[Array, Array, Array]:
    """Scores of blocks whose sum of squares is the variance of the score also for few blocks.

    A block with much of the information about a coefficient draws it towards its own torque, and
    therefore has a small residual (Bell, McCaffrey 2002; [1]_, equation 2.2).

    Parameters
    ----------
    score : ndarray of shape (n_coefficients,)
        Over all blocks.
    sums : ndarray of shape (n_blocks, n_coefficients)
        Scores of blocks with the remaining residual.
    grams : ndarray of shape (n_blocks, n_coefficients, n_coefficients)
        Products of the columns of every block.

    Returns
    -------
    score : ndarray of shape (n_coefficients,)
        For columns that are orthonormal.
    sums : ndarray of shape (n_blocks, n_coefficients)
        Of blocks for the same columns.
    share : ndarray of shape (n_blocks, n_coefficients, n_coefficients)
        Of every block of the information about the same coefficients.

    References
    ----------
    .. [1] G. W. Imbens, M. Kolesar (2016), Robust standard errors in small samples: some practical
       advice, Review of Economics and Statistics 98(4).
    """
    k = len(score)
    value, vector = np.linalg.eigh(grams.sum(0) + RIDGE * np.eye(k))
    root = vector / np.sqrt(np.maximum(value, RIDGE))
    share = root.T @ grams @ root
    value, vector = np.linalg.eigh(np.eye(k) - share)
    own = np.einsum("bji,bj->bi", vector, sums @ root) / np.sqrt(np.maximum(value, RIDGE))
    return score @ root, np.einsum("bij,bj->bi", vector, own), share


def time_blocks(problem: Problem, length: float) -> tuple[list[NDArray[np.int64]], int]:
    """Blocks of time within the trajectories, common to all joints.

    Parameters
    ----------
    problem : Problem
        Rows.
    length : float, s
        Desired length; the blocks of a trajectory have equal lengths close to it.

    Returns
    -------
    index : list of ndarray of shape (n_rows_j,)
        Block of every row, per joint.
    count : int
        Number of blocks.
    """
    rows = problem.rows
    if problem.signals.time is None:  # rows are successive samples
        length = float(len(np.unique(np.concatenate(rows.time)))) / 50
    place, span, share = rows.spans
    number = np.maximum(1, np.round(span / length)).astype(np.int64)
    first = np.cumsum(number) - number
    block = first[place] + np.minimum((share * number[place]).astype(np.int64), number[place] - 1)
    return rows.split(block), int(number.sum())


def block_length(problem: Problem, inflation: float) -> float:
    """Length of blocks of time that are nearly independent, in s.

    Parameters
    ----------
    problem : Problem
        Rows.
    inflation : float
        Of the variance, the largest of :func:`variance_inflation` of some joints.
    """
    return float(max(SHORTEST_BLOCK, CORRELATION_TIMES * problem.rows.hop * inflation))


def variance_inflation(
    problem: Problem, residual: Sequence[Array], joints: Sequence[int] | range
) -> Array:
    """Variance of a slow column's coefficient relative to that for independent rows, by joint.

    One plus twice the sum of the residual's autocorrelations up to the first small one.

    Parameters
    ----------
    problem : Problem
        Rows.
    residual : sequence of ndarray of shape (n_rows_j,)
        Residual rows of some joints.
    joints : sequence of int
        These joints, from 0.

    Returns
    -------
    ndarray of shape (len(joints),)
    """
    inflation = np.ones(len(joints))
    for i, (j, r) in enumerate(zip(joints, residual, strict=True)):
        x = r[problem.rows.in_time(j)]
        power = float(x @ x)
        if power <= 0:
            continue
        for lag in range(1, min(MOST_LAGS, len(x))):
            earlier = problem.rows.earlier(j, lag)
            rho = float(x[earlier] @ x[earlier + lag]) / power
            if rho < SMALL:
                break
            inflation[i] += 2 * rho
    return inflation


def false_discovery_rate(chance: float, n_tests: float) -> float:
    """The printed q-value: the p-value times the number of candidates, at most 1."""
    return min(1.0, chance * max(1, n_tests))
