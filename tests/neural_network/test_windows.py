# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
import torch

from skidyn.neural_network._windows import WindowLoader, WindowSet, window_rows, window_starts


@pytest.mark.parametrize("phase", [0, 1, 3])
def test_every_row_is_a_target_once_and_no_window_leaves_its_segment(phase):
    segments = [slice(0, 7), slice(7, 8), slice(8, 21)]
    rows, valid = window_rows(window_starts(segments, 4, phase), 4)
    np.testing.assert_array_equal(np.sort(rows[:, 4:][valid]), np.arange(21))
    owner = np.repeat([0, 1, 2], [7, 1, 13])
    assert all(len(set(owner[window])) == 1 for window in rows)


def test_loader_gives_every_weighted_row_once_per_pass():
    weight = np.r_[np.zeros(10), np.ones(20), np.full(7, 2.0)]
    targets = torch.as_tensor(np.c_[np.arange(37.0), weight], dtype=torch.float32)
    data = WindowSet(targets[:, :1], targets, [slice(0, 15), slice(15, 37)], window=4)
    for _ in range(3):
        batches = [y for _, y in WindowLoader(data, 2, np.random.default_rng(0))]
        seen = torch.cat([y.reshape(-1, 2) for y in batches])
        seen = seen[seen[:, 1] > 0]
        order = torch.argsort(seen[:, 0])
        assert torch.equal(seen[order], targets[10:])
