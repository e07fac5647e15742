# SPDX-License-Identifier: BSD-3-Clause
"""What is said about an effect is what the fit with it gives."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.diagnosis._held_out import folds_alone
from skidyn.diagnosis._profile import profile_error


def test_the_error_with_a_candidate_is_that_of_the_model_fitted_with_it(session):
    problem, ranking = session.problem, session._ranking
    blocks = [problem.term_rows(t) for t in session.terms]
    sigma = np.array([0.3, 0.1])
    model = ranking.model(blocks, sigma)

    def fitted(*more):
        return profile_error(problem, [*blocks, *more], sigma, ranking.target, passes=1).sum(0)

    for joint in (0, 1):
        found = ranking.held_out(model, joint)
        assert np.sum(found.residual**2) == pytest.approx(fitted()[joint], rel=1e-5)
        terms = [ranking.candidates[i].term for i in found.index]
        # the search does not hold out what one fold tells alone, as of a stop touched in one motion
        shared = [not folds_alone(problem, term).any() for term in terms]
        order = [at for at in np.argsort(-found.drops()) if shared[at]]
        for at in np.array(order)[[0, 5, 40]]:
            candidate = ranking.candidates[found.index[at]]
            added = fitted(candidate.rows)[joint]
            assert found.then[:, at].sum() == pytest.approx(added, rel=1e-3), candidate.term


def test_what_physics_forbids_is_not_offered(session):
    # a spring that pushes away from its rest would have a negative stiffness
    found = session._ranking.held_out(session._steps[0].model, 1)

    kinds = {session._ranking.candidates[i].kind for i in found.index}
    assert "spring" in kinds
    everyone = [i for i, c in enumerate(session._ranking.candidates) if 1 in c.rows]
    assert len(found.index) < len(everyone)
