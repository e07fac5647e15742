# SPDX-License-Identifier: BSD-3-Clause
"""What earlier rankings of a search found, which need not be looked for again.

A finding changes the residual of its joints and hardly that of others. What removed next to nothing
from a residual that is still the same still does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from skidyn._signals import Array
from skidyn.diagnosis._candidates import Candidate

#: Share of a joint's squared residual up to which a change of it does not require a new search.
SAME = 1e-3


class LookedAt:
    """Residuals at the last look at each joint, and what was found there.

    Parameters
    ----------
    n_joints : int
        Number of joints.

    Attributes
    ----------
    changed : set of int
        Joints, from 0, whose residual was not that of the look before.
    """

    def __init__(self, n_joints: int) -> None:
        self.changed = set(range(n_joints))
        self._residual: list[Array | None] = [None] * n_joints
        self._weak: set[Candidate] = set()
        self._found: dict[str, set[int]] = {}

    def compare(self, residual: Sequence[Array]) -> None:
        """Find the joints whose residual has changed.

        Parameters
        ----------
        residual : sequence of ndarray of shape (n_rows_j,), N m or N
            Averaged residual of every joint.
        """
        self.changed = set()
        for j, (before, now) in enumerate(zip(self._residual, residual, strict=True)):
            if before is None or np.sum((now - before) ** 2) > SAME * np.sum(before**2):
                self.changed.add(j)
                self._residual[j] = now

    def keep_weak(self, candidates: Sequence[Candidate], drops: Array, least: float) -> None:
        """Store which candidates remove too little to be found.

        Parameters
        ----------
        candidates : sequence of Candidate
            Candidates.
        drops : ndarray of shape (n_candidates,)
            Held-out squared error that each removes, in units of the noise.
        least : float
            What a finding must remove in addition to the price of its coefficients.
        """
        for candidate, drop in zip(candidates, drops.tolist(), strict=True):
            # a refined shape may remove more than the nearest one of the grid
            if drop - 2 * candidate.width < least / 2:
                self._weak.add(candidate)
            else:
                self._weak.discard(candidate)

    def forget(self, candidates: Iterable[Candidate]) -> None:
        """Look at some candidates again, since their columns have changed."""
        self._weak.difference_update(candidates)

    def is_open(self, candidate: Candidate) -> bool:
        """Whether a candidate may remove something that it did not remove at the last look."""
        return candidate not in self._weak or not self.changed.isdisjoint(candidate.rows)

    def joints(self, look: str) -> set[int]:
        """Joints, from 0, at which a further look may find something.

        Parameters
        ----------
        look : str
            Name of the look.
        """
        return self.changed | self._found.get(look, self.changed)

    def may_find(self, look: str) -> Callable[[Candidate], bool]:
        """Function that returns whether a candidate acts where a further look may find something.

        Parameters
        ----------
        look : str
            Name of the look.
        """
        joints = self.joints(look)
        return lambda candidate: not joints.isdisjoint(candidate.rows)

    def keep(self, look: str, joints: Iterable[int]) -> None:
        """Store the joints, from 0, at which a further look found something."""
        self._found[look] = set(joints)
