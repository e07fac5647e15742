# SPDX-License-Identifier: BSD-3-Clause
"""Cases of a planar arm."""

import pytest

from skidyn.datasets import SuiteCase


@pytest.fixture(scope="session")
def planar_case():
    """A short log of a planar arm that hides effects of some kinds."""
    pytest.importorskip("mujoco", reason="the suite is simulated by MuJoCo")

    def made(content, *kinds, tier="short"):
        return SuiteCase("case_007", "planar_arm", tier, content, kinds, (3, 7))

    return made
