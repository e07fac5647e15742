# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
import torch

from skidyn.neural_network._windows import WindowLoader, WindowSet, window_rows, window_starts


@pytest.mark.parametrize("phase", [0, 1, 3])
def test_every_row_is_a_target_once_and_no_window_leaves_its_segment(phase):
    segments = [slice(0, 7), slice(7, 8), slice(8, 21)]
    rows, valid = window_rows(window_starts(segments, 4, phase), window=6, stride=4)
    np.testing.assert_array_equal(np.sort(rows[:, 6:][valid]), np.arange(21))
    owner = np.repeat([0, 1, 2], [7, 1, 13])
    assert all(len(set(owner[window])) == 1 for window in rows)


def test_loader_gives_every_member_each_of_its_rows_once_per_pass():
    """Members whose bootstraps have kept few rows have smaller batches, not fewer."""
    rows = np.arange(37.0)
    weights = [np.r_[np.zeros(10), np.ones(20), np.full(7, 2.0)], (rows == 36) * 3.0]
    targets = [torch.as_tensor(np.c_[rows, w], dtype=torch.float32) for w in weights]
    inputs = torch.stack([targets[0][:, :1]] * 2)
    data = WindowSet(
        inputs, torch.stack(targets), [slice(0, 15), slice(15, 37)], window=6, stride=4
    )
    generators = [np.random.default_rng(k) for k in range(2)]
    for _ in range(3):
        batches = [y for _, y in WindowLoader(data, 2, generators)]
        for member in range(2):
            seen = torch.cat([y[member].reshape(-1, 2) for y in batches])
            seen = seen[seen[:, 1] > 0]
            order = torch.argsort(seen[:, 0])
            expected = targets[member][targets[member][:, 1] > 0]
            assert torch.equal(seen[order], expected)
