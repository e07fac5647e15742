# SPDX-License-Identifier: BSD-3-Clause
"""Windows of a log that never leave a segment, gathered batch by batch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray


def window_starts(segments: list[slice], window: int, phase: int = 0) -> NDArray[np.int64]:
    """First target row, and first and last row of the segment, of every window.

    A segment is cut at multiples of ``window`` rows, counted from its first row minus ``phase``.
    """
    rows = []
    for segment in segments:
        starts = np.arange(segment.start - phase, segment.stop, window)
        rows.append(np.c_[starts, np.full((len(starts), 2), [segment.start, segment.stop - 1])])
    return np.concatenate(rows).astype(np.int64)


def window_rows(starts: NDArray[np.int64], window: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Rows that each window reads, and which of its targets lie in the segment.

    A window reads ``window`` rows of history and then its ``window`` target rows. Where the
    history would begin before the segment, the segment's first row stands in for it, as if the
    robot had rested there.

    Returns
    -------
    rows : ndarray of shape (n_windows, 2 * window)
    valid : ndarray of bool of shape (n_windows, window)
    """
    wanted = starts[:, :1] + np.arange(-window, window)
    first, last = starts[:, 1:2], starts[:, 2:3]
    targets = wanted[:, window:]
    return np.clip(wanted, first, last), (targets >= first) & (targets <= last)


class WindowSet(torch.utils.data.Dataset):
    """Inputs, targets and weights of a log, cut into windows.

    Parameters
    ----------
    inputs : tensor of shape (n_samples, n_inputs)
        Scaled inputs.
    targets : tensor of shape (n_samples, n_outputs + 1)
        Scaled targets, and the weight of the row as the last column.
    segments : list of slice
        Rows that belong together.
    window : int
        Targets per window, and rows of history before them.
    """

    def __init__(
        self, inputs: torch.Tensor, targets: torch.Tensor, segments: list[slice], window: int
    ) -> None:
        self.inputs = inputs
        self.targets = targets
        self.segments = segments
        self.window = window
        self.weighted = (targets[:, -1] > 0).cpu().numpy()

    def __len__(self) -> int:
        return len(window_starts(self.segments, self.window))

    def __getitem__(self, index: int) -> Any:
        raise TypeError("windows are gathered in batches")

    def cut(self, phase: int) -> tuple[torch.Tensor, torch.Tensor]:
        """Rows and valid targets of all windows in which some target counts."""
        starts = window_starts(self.segments, self.window, phase)
        rows, valid = window_rows(starts, self.window)
        valid &= self.weighted[rows[:, self.window :]]
        used = valid.any(axis=1)
        device = self.inputs.device
        return torch.as_tensor(rows[used], device=device), torch.as_tensor(
            valid[used], device=device
        )


class WindowLoader:
    """Batches of windows, gathered at once instead of sample by sample.

    For training (``generator`` given) the windows come in random order, and each pass cuts the log
    at another phase, so that no alignment of the windows is learned.
    """

    def __init__(
        self,
        dataset: WindowSet,
        batch_size: int = 16,
        generator: np.random.Generator | None = None,
    ) -> None:
        self.dataset = dataset
        self.batch_size = batch_size
        self.generator = generator

    def __iter__(self) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        data, generator = self.dataset, self.generator
        phase = 0 if generator is None else int(generator.integers(data.window))
        rows, valid = data.cut(phase)
        order = np.arange(len(rows)) if generator is None else generator.permutation(len(rows))
        for i in range(0, len(order), self.batch_size):
            chosen = torch.as_tensor(order[i : i + self.batch_size], device=rows.device)
            batch = rows[chosen]
            targets = data.targets[batch[:, data.window :]]
            targets[..., -1] *= valid[chosen]
            yield data.inputs[batch], targets
