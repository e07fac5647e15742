# SPDX-License-Identifier: BSD-3-Clause
"""Windows of a log that never leave a segment, gathered batch by batch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray


def window_starts(segments: list[slice], stride: int, phase: int = 0) -> NDArray[np.int64]:
    """First target row, and first and last row of the segment, of every window.

    A segment is cut at multiples of ``stride`` rows, counted from its first row minus ``phase``.
    """
    rows = []
    for segment in segments:
        starts = np.arange(segment.start - phase, segment.stop, stride)
        rows.append(np.c_[starts, np.full((len(starts), 2), [segment.start, segment.stop - 1])])
    return np.concatenate(rows).astype(np.int64)


def window_rows(
    starts: NDArray[np.int64], window: int, stride: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Rows that each window reads, and which of its targets lie in the segment.

    A window reads ``window`` rows of history and then its ``stride`` target rows. Where the
    history would begin before the segment, the segment's first row stands in for it, as if the
    robot had rested there.

    Returns
    -------
    rows : ndarray of shape (n_windows, window + stride)
    valid : ndarray of bool of shape (n_windows, stride)
    """
    wanted = starts[:, :1] + np.arange(-window, stride)
    first, last = starts[:, 1:2], starts[:, 2:3]
    targets = wanted[:, window:]
    return np.clip(wanted, first, last), (targets >= first) & (targets <= last)


class WindowSet(torch.utils.data.Dataset[Any]):
    """Inputs, targets and weights of a log for every member of an ensemble, cut into windows.

    Parameters
    ----------
    inputs : list of tensor of shape (n_samples, n_inputs)
        Scaled inputs, one table a member.
    targets : list of tensor of shape (n_samples, n_outputs + 1)
        Scaled targets, and the weight of the row as the last column.
    segments : list of slice
        Rows that belong together.
    window, stride : int
        Rows of history and targets per window.
    """

    def __init__(
        self,
        inputs: list[torch.Tensor],
        targets: list[torch.Tensor],
        segments: list[slice],
        window: int,
        stride: int,
    ) -> None:
        self.inputs = inputs
        self.targets = targets
        self.segments = segments
        self.window = window
        self.stride = stride
        self.weighted = [(table[:, -1] > 0).cpu().numpy() for table in targets]

    def __len__(self) -> int:
        return len(window_starts(self.segments, self.stride))

    def __getitem__(self, index: int) -> Any:
        raise TypeError("windows are gathered in batches")

    def cut(self, member: int, phase: int) -> tuple[NDArray[Any], NDArray[Any]]:
        """Rows and valid targets of all windows in which some target counts for a member."""
        starts = window_starts(self.segments, self.stride, phase)
        rows, valid = window_rows(starts, self.window, self.stride)
        valid &= self.weighted[member][rows[:, self.window :]]
        used = valid.any(axis=1)
        return rows[used], valid[used]

    def gather(
        self, member: int, rows: NDArray[Any], valid: NDArray[Any]
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Inputs and targets of one batch of a member."""
        device = self.inputs[member].device
        chosen = torch.as_tensor(rows, device=device)
        targets = self.targets[member][chosen[:, self.window :]]
        targets[..., -1] *= torch.as_tensor(valid, device=device)
        return self.inputs[member][chosen], targets


class WindowLoader:
    """Batches of windows, gathered at once instead of sample by sample.

    A batch holds one batch of every member. All members have equally many batches, so that one
    with fewer windows has smaller ones. For training (``generators`` given, one a member) the
    windows come in random order, and each pass cuts the log at another phase, so that no alignment
    of the windows is learned.
    """

    def __init__(
        self,
        dataset: WindowSet,
        batch_size: int = 16,
        generators: list[np.random.Generator] | None = None,
    ) -> None:
        self.dataset = dataset
        self.batch_size = batch_size
        self.generators = generators

    def __iter__(self) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        data, cuts, orders = self.dataset, [], []
        for member in range(len(data.inputs)):
            generator = None if self.generators is None else self.generators[member]
            phase = 0 if generator is None else int(generator.integers(data.stride))
            cuts.append(data.cut(member, phase))
            n = len(cuts[-1][0])
            orders.append(np.arange(n) if generator is None else generator.permutation(n))
        n_batches = -(-max(len(order) for order in orders) // self.batch_size)
        for parts in zip(*(np.array_split(order, n_batches) for order in orders), strict=True):
            size, batches = max(len(part) for part in parts), []
            for member, (part, (rows, valid)) in enumerate(zip(parts, cuts, strict=True)):
                # filled up with a window that has no weight
                full = np.append(part, np.zeros(size - len(part), dtype=int))
                counts = valid[full] & (np.arange(size) < len(part))[:, None]
                batches.append(data.gather(member, rows[full], counts))
            inputs, targets = (torch.stack(tables) for tables in zip(*batches, strict=True))
            yield inputs, targets
