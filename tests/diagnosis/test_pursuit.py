# SPDX-License-Identifier: BSD-3-Clause
"""Matching pursuit judged by folds that are left out, against fits one by one."""

import numpy as np
import pytest

from skidyn.diagnosis._pursuit import Products, pursue


def held_out_error(columns, residual, fold):
    error = 0.0
    for f in np.unique(fold):
        away, here = fold != f, fold == f
        solution = np.linalg.lstsq(columns[away], residual[away], rcond=None)[0]
        error += np.sum((residual[here] - columns[here] @ solution) ** 2)
    return error


def greedy(columns, residual, fold, worth, longest):
    chosen, reached = [], residual @ residual
    while len(chosen) < longest:
        errors = [
            held_out_error(columns[:, [*chosen, c]], residual, fold)
            if c not in chosen
            else held_out_error(columns[:, chosen], residual, fold)
            for c in range(columns.shape[1])
        ]
        best = int(np.argmin(errors))
        if reached - errors[best] < worth:
            break
        chosen.append(best)
        reached = errors[best]
    return chosen, reached


@pytest.mark.parametrize("seed", range(4))
def test_it_chooses_what_fits_one_by_one_would(seed):
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(200, 12)) * 10.0 ** rng.uniform(-4, 4, 12)
    columns[:, 5] = 0.0  # a column that says nothing
    residual = columns @ (rng.normal(size=12) / columns.std(0).clip(1e-9)) + rng.normal(size=200)
    fold = rng.integers(0, 6, 200)
    found, reached = pursue(Products.of_columns(columns, residual, fold), worth=5.0, longest=5)
    expected, error = greedy(columns, residual, fold, 5.0, 5)
    assert found == expected
    assert reached == pytest.approx(error, rel=1e-9)


def test_a_copy_of_a_chosen_column_adds_nothing():
    rng = np.random.default_rng(0)
    column = rng.normal(size=100)
    columns = np.column_stack([column, 3 * column, rng.normal(size=100)])
    products = Products.of_columns(columns, column, np.arange(100) % 5)
    found, _ = pursue(products, worth=1e-6, longest=3)
    assert len(found) == 1
