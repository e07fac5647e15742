# SPDX-License-Identifier: BSD-3-Clause
"""What is tried depends on the log and on the model."""

import numpy as np

from skidyn.diagnosis import catalogue_candidates


def test_what_the_model_has_or_the_log_cannot_show_is_not_tried(missing):
    kinds = ["viscous", "spring", "temperature_friction"]
    candidates = catalogue_candidates(missing.problem, kinds)
    assert {c.kind for c in candidates} == {"spring"}
    assert {c.site for c in candidates} == {("spring", (0,)), ("spring", (1,))}


def test_shapes_make_candidates_of_one_site(missing):
    candidates = catalogue_candidates(missing.problem, ["stribeck"])
    sites = [c.site for c in candidates]
    assert len(sites) > len(set(sites)) == 2
    assert all(c.n_shapes > 0 and c.width == len(c.lowest) for c in candidates)


def test_physics_forbids_a_stop_that_pulls(missing):
    stop = next(
        c for c in catalogue_candidates(missing.problem, ["end_stop"]) if not c.is_further_form
    )
    assert stop.allows(np.array([2.0])) and not stop.allows(np.array([-2.0]))
