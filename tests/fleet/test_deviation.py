# SPDX-License-Identifier: BSD-3-Clause
"""Robots that deviate are found, and healthy fleets stay quiet."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.evidence import Evidence, evidence_from_parquet
from skidyn.exceptions import LogError, SkidynError
from skidyn.fleet import compare_fleet

TORQUES = ("tau1", "tau2")
COLUMNS = ("m_link1", "viscous.Fv[1]", "coulomb.Fc[1]", "coulomb.Fc[2]")


def make_fleet(n_robots, seed, worn=(), scatter=0.05):
    """Robots that differ by nature, with the friction of joint 2 raised in some."""
    rng, fleet = np.random.default_rng(seed), {}
    for robot in range(n_robots):
        true = np.array([4.0, 1.0, 2.0, 3.0])
        true[1:] += scatter * rng.normal(size=3)
        true[3] += 1.0 * (robot in worn)
        rows = {}
        for trajectory in range(4):
            for joint in range(2):
                a = rng.normal(size=(60, 4))
                a[:, 1 if joint else 3] = 0.0
                a[:, 2] *= 1 - joint
                torque = a @ true + 0.3 * rng.normal(size=60)
                rows[trajectory, joint] = np.column_stack([a, torque])
        fleet[f"r{robot}"] = Evidence.from_rows(COLUMNS, rows)
    return fleet


def test_worn_robots_are_named_with_their_effect():
    comparison = compare_fleet(make_fleet(60, 0, worn=(5, 17, 40)))
    table = comparison.table()
    assert {(row["robot"], row["column"]) for row in table} >= {
        (name, "coulomb.Fc[2]") for name in ("r5", "r17", "r40")
    }
    assert len(table) <= 4
    row = next(row for row in table if row["robot"] == "r17")
    assert row["deviation"] == pytest.approx(1.0, abs=0.3)
    assert comparison.common["m_link1"] == pytest.approx(4.0, abs=0.05)


def test_healthy_fleets_raise_few_alarms():
    """Without worn robots, a fleet has any false alarm in about 5 % of cases."""
    alarms = sum(bool(compare_fleet(make_fleet(40, seed)).table()) for seed in range(20))
    assert alarms <= 4


def test_motion_that_does_not_tell_is_not_judged():
    fleet = make_fleet(10, 1)
    still = {key: factor.copy() for key, factor in fleet["r3"].factors.items()}
    for factor in still.values():
        factor[:, 3] = 0.0
    fleet["r3"] = Evidence(COLUMNS, still, fleet["r3"].counts)
    comparison = compare_fleet(fleet)
    assert np.isnan(comparison.q_value[3, 2]) and np.isfinite(comparison.q_value[4]).all()


def test_wrong_fleets_are_refused():
    with pytest.raises(SkidynError, match="8 are needed"):
        compare_fleet(make_fleet(3, 0))
    fleet = make_fleet(9, 0)
    with pytest.raises(SkidynError, match="no column dahl"):
        compare_fleet(fleet, ["dahl"])
    fleet["r4"] = Evidence.from_rows(("a",), {(0, 0): np.ones((3, 2))})
    with pytest.raises(SkidynError, match="'r4' has different columns"):
        compare_fleet(fleet)


def test_evidence_that_is_no_number_names_its_robot():
    fleet = make_fleet(50, 0)
    broken = {key: factor.copy() for key, factor in fleet["r37"].factors.items()}
    broken[0, 0][0, 1] = np.nan
    with pytest.raises(SkidynError, match="r37"):
        fleet["r37"] = Evidence(COLUMNS, broken, fleet["r37"].counts)
        compare_fleet(fleet)


def test_one_broken_log_of_fifty_is_named_and_the_others_are_compared(tmp_path):
    pytest.importorskip("pyarrow", reason="needs skidyn[io]")
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    rng, evidence, refused = np.random.default_rng(0), {}, []
    for k in range(50):
        file = tmp_path / f"robot_{k}.parquet"
        noisy = {name: log.frame[name] + 0.3 * rng.normal(size=len(log.frame)) for name in TORQUES}
        log.frame.assign(**noisy).to_parquet(file)
        if k == 37:
            file.write_bytes(file.read_bytes()[:-500])
        try:
            evidence[file.stem] = evidence_from_parquet(file, log.robot)
        except LogError as error:
            refused.append(str(error))
    assert len(refused) == 1 and "robot_37.parquet" in refused[0]
    assert len(compare_fleet(evidence).robots) == 49
