# SPDX-License-Identifier: BSD-3-Clause
"""Factors of evidence: merging, leaving out and solving equal the same on all rows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.evidence import Evidence
from skidyn.identification import RBDRegressor

NAMES = ("a", "b", "c")


@pytest.fixture
def rows():
    rng = np.random.default_rng(0)
    blocks = {}
    for trajectory in range(4):
        for joint in range(2):
            a = rng.normal(size=(30 + 5 * trajectory, 3))
            noise = (0.1, 1.0)[joint] * rng.normal(size=len(a))
            blocks[trajectory, joint] = np.column_stack([a, a @ [1.0, -2.0, 0.5] + noise])
    return blocks


def stacked(rows, keys=None):
    return np.vstack([block for key, block in rows.items() if keys is None or key in keys])


def test_solving_equals_least_squares_on_all_rows(rows):
    whole = stacked(rows)
    expected = np.linalg.lstsq(whole[:, :-1], whole[:, -1])[0]
    np.testing.assert_allclose(Evidence.from_rows(NAMES, rows).solve(), expected, rtol=1e-10)


def test_merging_is_exact_and_in_any_order(rows):
    first = Evidence.from_rows(NAMES, {k: b[:10] for k, b in rows.items()})
    others = {k: b[10:] for k, b in rows.items()}
    second = Evidence.from_rows(NAMES, others)
    whole = Evidence.from_rows(NAMES, rows)

    for merged in (first + second, second + first, first.with_rows(others)):
        assert merged.counts == whole.counts
        np.testing.assert_allclose(merged.solve(), whole.solve(), rtol=1e-10)


def test_leaving_out_equals_never_having_seen(rows):
    evidence = Evidence.from_rows(NAMES, rows)
    rest = {key: block for key, block in rows.items() if key[0] != 2}

    np.testing.assert_allclose(
        evidence.without(2).solve(), Evidence.from_rows(NAMES, rest).solve(), rtol=1e-12
    )
    b = evidence.without(2).solve()
    block = rows[2, 1]
    expected = np.sqrt(np.mean((block[:, -1] - block[:, :-1] @ b) ** 2))
    assert evidence.held_out_error()[2, 1] == pytest.approx(expected, rel=1e-10)


def test_noise_weights_the_joints_and_columns_can_be_left_out(rows):
    evidence = Evidence.from_rows(NAMES, rows)
    noise = evidence.noise(evidence.solve())
    assert noise[0] == pytest.approx(0.1, rel=0.2)
    assert noise[1] == pytest.approx(1.0, rel=0.2)
    truth = np.array([1.0, -2.0, 0.5])
    plain, weighted = evidence.solve(), evidence.solve(noise=noise)
    assert np.abs(weighted - truth).max() < np.abs(plain - truth).max()
    assert evidence.solve(["a", "b"])[2] == 0.0


def test_errors_say_what_is_wrong(rows):
    evidence = Evidence.from_rows(NAMES, rows)
    with pytest.raises(ValueError, match="no column 'd'"):
        evidence.solve(["d"])
    with pytest.raises(ValueError, match="different columns"):
        evidence + Evidence.from_rows(("x", "y", "z"), rows)
    with pytest.raises(ValueError, match="trajectory 0, joint 1"):
        Evidence.from_rows(("a",), rows)
    with pytest.raises(ValueError, match="every trajectory was left out"):
        evidence.only([]).solve()


def test_the_model_of_a_regressor_follows_from_its_evidence():
    log = make_hidden_effect_log(load_planar_arm(), None, random_state=1)
    model = RBDRegressor(log.robot).fit(log.X, log.y)

    noise = dict(enumerate(model.noise_std_))
    coefficients = model.evidence_.solve(noise=noise)

    friction = dict(zip(model.evidence_.columns, coefficients, strict=True))
    assert friction["viscous.Fv[1]"] == pytest.approx(
        model.effect_coefficients_[model.effect_terms_[0]][0], rel=1e-4
    )


def test_shifted_evidence_keeps_recordings_apart():
    rows = np.random.default_rng(1).normal(size=(3, 30, 3))
    one = Evidence.from_rows(("a", "b"), {(k, 0): rows[k] for k in range(3)})
    both = one + one.shifted(3)
    assert both.trajectories == [0, 1, 2, 3, 4, 5]
    np.testing.assert_array_equal(both.factors[4, 0], one.factors[1, 0])
    merged = one.shifted(1, groups=2)
    assert dict(merged.counts) == {(1, 0): 60, (0, 0): 30}
    np.testing.assert_allclose(merged.solve(), one.solve(), rtol=1e-10)


def test_columns_without_information_get_no_coefficient():
    rng = np.random.default_rng(0)
    a = rng.normal(size=(50, 3))
    a[:, 1] = 0.0
    rows = np.column_stack([a, a @ [1.0, 5.0, 2.0]])
    np.testing.assert_allclose(
        Evidence.from_rows(("a", "b", "c"), {(0, 0): rows}).solve(), [1.0, 0.0, 2.0], atol=1e-12
    )
    twice = np.column_stack([a[:, 0], a[:, 0], a[:, 0] * 2])
    np.testing.assert_allclose(  # the shortest of all solutions
        Evidence.from_rows(("a", "b"), {(0, 0): twice}).solve(), [1.0, 1.0], atol=1e-12
    )


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**31), factors=st.lists(st.floats(1e-6, 1e6), min_size=3, max_size=3))
def test_units_of_the_columns_do_not_change_the_fit(seed, factors):
    rows = np.random.default_rng(seed).normal(size=(40, 4))
    one = Evidence.from_rows(("a", "b", "c"), {(0, 0): rows}).solve()
    other = Evidence.from_rows(("a", "b", "c"), {(0, 0): rows * [*factors, 1.0]}).solve()
    np.testing.assert_allclose(other * factors, one, rtol=1e-8, atol=1e-10)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**31), order=st.permutations(range(5)))
def test_the_order_of_recordings_does_not_change_the_fit(seed, order):
    rows = np.random.default_rng(seed).normal(size=(5, 30, 3))
    parts = [Evidence.from_rows(("a", "b"), {(k, 0): rows[k]}) for k in range(5)]
    forth, back = (sum(p[1:], p[0]) for p in (parts, [parts[k] for k in order]))
    np.testing.assert_allclose(forth.solve(), back.solve(), rtol=1e-10)
    np.testing.assert_allclose(
        Evidence.from_rows(("a", "b"), {(0, 0): np.vstack(rows)}).solve(), forth.solve(), rtol=1e-9
    )
