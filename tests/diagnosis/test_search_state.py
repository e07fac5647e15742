# SPDX-License-Identifier: BSD-3-Clause
"""What a search hands on."""

import numpy as np


def test_what_was_found_is_no_candidate_any_more(missing):
    found = {c.site for h in missing.result.findings for c in h.candidates}
    left = {c.site for c in missing.result.candidates}
    assert found == {("spring", (1,))} and not found & left
    assert missing.result.n_tests > len(left)


def test_the_last_fit_holds_every_finding(missing):
    fit = missing.result.fit
    assert {("spring", (1,))} <= {(t.kind, t.places) for t in fit.terms}
    assert np.isfinite(fit.coefficients).all() and (fit.noise > 0).all()
