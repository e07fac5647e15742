# SPDX-License-Identifier: BSD-3-Clause
"""The quick held-out residual is that of the diagnosis."""

from __future__ import annotations

import numpy as np

from skidyn.diagnosis._held_out import held_out_residual


def test_it_is_that_of_the_diagnosis(session):
    session.add("spring", joint=2)
    step = session._steps[-1]

    sigma = step.model.weight**-0.5
    slow, _ = held_out_residual(session.problem, session.terms, sigma)

    np.testing.assert_allclose(step.residual, slow, atol=1e-7 * np.abs(slow).max())
