# SPDX-License-Identifier: BSD-3-Clause
"""What a session shows: curves, residuals, sizes, how sure a name is."""

from __future__ import annotations

import numpy as np


def test_curves_keep_peaks_and_residuals_follow_what_was_added(session, log):
    measured = np.asarray(log.y)[log.X["trajectory"] == 3, 1]
    session.add("spring", joint=2)

    curves, residuals = session.curves(2, 3), session.residuals(2, 3)

    assert max(curves["measured"]) == measured.max()
    assert None in curves["given"]  # where the joint rests or turns
    given, now = (
        np.sqrt(np.mean([x**2 for x in residuals[k] if x is not None])) for k in ("given", "now")
    )
    assert now < 0.2 * given


def test_what_was_added_is_told_with_its_interval(session):
    session.add("spring", joint=2)
    (told,) = session.sizes()
    assert told.startswith("k = ") and "±" in told and "N m/rad" in told
    (sure,) = session.sure()
    assert sure.startswith("confidence ")
