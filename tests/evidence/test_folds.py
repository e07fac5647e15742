# SPDX-License-Identifier: BSD-3-Clause
"""Folds left out by subtraction give what fits without their rows give."""

from types import SimpleNamespace

import numpy as np
import pytest

from skidyn.evidence import (
    Normal,
    column_sizes,
    fold_products,
    jackknife,
    left_out_coefficients,
    left_out_errors,
    solve_left_out,
    without_each,
)


@pytest.fixture
def rows():
    """Two joints with three columns, in four folds of different size."""
    rng = np.random.default_rng(0)
    fold = [np.repeat(np.arange(4), n) for n in ((20, 30, 25, 40), (15, 35, 20, 30))]
    design = [rng.normal(size=(len(f), 3)) * [1.0, 50.0, 1e-3] for f in fold]
    target = [a @ [1.0, 0.2, 300.0] + rng.normal(size=len(a)) for a in design]
    return SimpleNamespace(fold=fold, n_folds=4), design, np.array([1.0, 2.0]), target


def lstsq(design, sigma, target, keep):
    a = np.vstack([d[k] / s for d, s, k in zip(design, sigma, keep, strict=True)])
    y = np.concatenate([t[k] / s for t, s, k in zip(target, sigma, keep, strict=True)])
    return np.linalg.lstsq(a, y, rcond=None)[0]


def test_left_out_by_subtraction_is_left_out(rows):
    folds, design, sigma, target = rows
    whole, left = left_out_coefficients(folds, design, sigma, target)
    assert whole == pytest.approx(lstsq(design, sigma, target, [f >= 0 for f in folds.fold]))
    for k in range(4):
        expected = lstsq(design, sigma, target, [f != k for f in folds.fold])
        assert left[k] == pytest.approx(expected, rel=1e-6)


def test_errors_of_folds_left_out(rows):
    folds, design, sigma, target = rows
    full = [np.column_stack(pair) for pair in zip(design, target, strict=True)]
    grams, _ = fold_products(folds, full, sigma, target)
    _, left = left_out_coefficients(folds, design, sigma, target)
    for k, error in enumerate(left_out_errors(grams, ridge=1e-9)):
        expected = sum(
            np.sum((t[f == k] - a[f == k] @ left[k]) ** 2) / s**2
            for a, t, f, s in zip(design, target, folds.fold, sigma, strict=True)
        )
        assert error == pytest.approx(expected)


def test_instruments_stand_left(rows):
    folds, design, sigma, target = rows
    instruments = [a + 0.1 * a**3 / np.abs(a).max(0) ** 2 for a in design]
    whole, _ = left_out_coefficients(folds, design, sigma, target, instruments)
    z, a, y = (
        np.concatenate([x / s for x, s in zip(parts, sigma, strict=True)])
        for parts in (instruments, design, target)
    )
    assert whole == pytest.approx(np.linalg.solve(z.T @ a, z.T @ y), rel=1e-6)


def test_a_prior_pulls_all_fits(rows):
    folds, design, sigma, target = rows
    grams, cross = fold_products(folds, design, sigma, target)
    pull = 1e9 * np.diag(np.diag(grams.sum(0)))
    whole, left = solve_left_out(grams, cross, (pull, pull @ [1.0, 2.0, 3.0]))
    assert np.vstack([whole, left]) == pytest.approx(np.tile([1.0, 2.0, 3.0], (5, 1)), rel=1e-5)


def test_what_the_fold_left_out_tells_alone_stays_as_all_folds_have_it(rows):
    folds, design, sigma, target = rows
    for block, fold in zip(design, folds.fold, strict=True):
        block[:, 1] *= np.where(fold == 2, 1.0, 1e-3)  # little is known of it without the third
    grams, cross = fold_products(folds, design, sigma, target)
    kept = np.zeros((4, 3), dtype=bool)
    kept[2, 1] = True

    whole, free = solve_left_out(grams, cross)
    _, left = solve_left_out(grams, cross, kept=kept)

    assert abs(free[2, 1] - whole[1]) > 10 * abs(left[2, 1] - whole[1])
    assert left[2, 1] == pytest.approx(whole[1], abs=1e-3)
    np.testing.assert_allclose(left[[0, 1, 3]], free[[0, 1, 3]])


def test_a_column_that_vanishes_gets_no_coefficient():
    gram = np.diag([4.0, 0.0])
    assert Normal(gram, np.array([8.0, 0.0]), column_sizes(gram)).solution == pytest.approx([2, 0])


def test_jackknife_of_a_mean_is_its_standard_error():
    values = np.random.default_rng(1).normal(size=12)
    means = (values.sum() - values) / 11
    assert jackknife(means) == pytest.approx(values.std(ddof=1) / np.sqrt(12))
    assert np.isnan(jackknife(means[:1, None])).all()


def test_each_part_is_left_out_once():
    parts = [np.full((2, 1), k) for k in range(3)]
    assert [sorted(set(rows.ravel())) for rows in without_each(parts)] == [[1, 2], [0, 2], [0, 1]]
