# SPDX-License-Identifier: BSD-3-Clause
"""Cases of a planar arm."""

from types import SimpleNamespace

import pandas as pd
import pytest

from skidyn.datasets import SuiteCase


@pytest.fixture(scope="session")
def planar_case():
    """A short log of a planar arm that hides effects of some kinds."""
    pytest.importorskip("mujoco", reason="the suite is simulated by MuJoCo")

    def made(content, *kinds, tier="short"):
        return SuiteCase("case_007", "planar_arm", tier, content, kinds, (3, 7))

    return made


@pytest.fixture(scope="session")
def empty(planar_case):
    """A log that hides nothing."""
    return planar_case("nothing").make()


@pytest.fixture(scope="session")
def written(planar_case, tmp_path_factory):
    """The folder of a case that hides an offset, its log and its truth, which lies elsewhere."""
    folder = tmp_path_factory.mktemp("suite")
    truth = planar_case("one", "offset").write(folder)
    case = folder / "cases" / "case_007"
    return SimpleNamespace(case=case, frame=pd.read_parquet(case / "log.parquet"), truth=truth)


@pytest.fixture(scope="session")
def once(planar_case):
    """A log with a spring in one of its recordings."""
    return planar_case("once", "spring").make()
