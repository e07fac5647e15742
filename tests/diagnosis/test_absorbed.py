# SPDX-License-Identifier: BSD-3-Clause
"""What identified bodies take in of a torque is what a fit of the model leaves less of it."""

import numpy as np
import pytest

from skidyn.diagnosis._absorbed import absorbed_directions, left_of


@pytest.mark.parametrize("joint", [0, 1])
def test_what_is_left_is_the_residual_of_a_fit_to_all_joints(complete, joint):
    problem = complete.problem
    fit = problem.fit_own()
    directions = absorbed_directions(problem, fit.terms, fit.sigma)
    design = problem.design([problem.term_rows(term) for term in fit.terms])
    torque = [np.zeros(len(rows)) for rows in design]
    rng = np.random.default_rng(joint)
    bodies = design[joint] @ rng.normal(size=design[joint].shape[1])
    torque[joint] = bodies / bodies.std() + rng.normal(size=len(bodies))

    weighted = np.vstack([rows / s for rows, s in zip(design, fit.sigma, strict=True)])
    target = np.concatenate([y / s for y, s in zip(torque, fit.sigma, strict=True)])
    solution = np.linalg.lstsq(weighted, target)[0]

    expected = torque[joint] - design[joint] @ solution
    found = left_of(torque[joint][:, None], directions[joint])[:, 0]
    taken = np.linalg.norm(torque[joint] - expected)
    assert taken > 0.1 * np.linalg.norm(torque[joint])
    assert np.linalg.norm(found - expected) < 0.1 * taken
