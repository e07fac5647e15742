# SPDX-License-Identifier: BSD-3-Clause
"""Windows of a log that never leave a segment, gathered batch by batch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import embedding


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
    """Rows that each window reads, and a mask of its targets that lie in the segment.

    A window reads ``window`` rows of history and then its ``stride`` target rows. If the history
    would begin before the segment, the first row of the segment is repeated, as if the robot had
    rested there. Shapes are (n_windows, window + stride) and (n_windows, stride).
    """
    wanted = starts[:, :1] + np.arange(-window, stride)
    first, last = starts[:, 1:2], starts[:, 2:3]
    targets = wanted[:, window:]
    return np.clip(wanted, first, last), (targets >= first) & (targets <= last)


class WindowSet(torch.utils.data.Dataset[Any]):
    """Inputs, targets and weights of a log for every member of an ensemble, cut into windows.

    Inputs and targets are scaled, of shape (n_members, n_samples, ...); the last column of the
    targets is the weight of the row.
    """

    def __init__(
        self,
        inputs: torch.Tensor,
        targets: torch.Tensor,
        segments: list[slice],
        window: int,
        stride: int,
    ) -> None:
        self.n_members, self.n_samples = inputs.shape[:2]
        self.inputs = inputs.flatten(0, 1)
        self.targets = targets.flatten(0, 1)
        self.segments = segments
        self.window = window
        self.stride = stride
        self._offsets = torch.arange(-window, stride, device=inputs.device)[:, None, None]
        first_rows = torch.arange(self.n_members, device=inputs.device) * self.n_samples
        self._first_rows = first_rows[:, None]
        weighted = (targets[..., -1] > 0).cpu().numpy()
        # weighted rows before each row
        self.n_before = np.cumsum(np.pad(weighted, ((0, 0), (1, 0))), axis=1)

    def __len__(self) -> int:
        return len(window_starts(self.segments, self.stride))

    def __getitem__(self, index: int) -> Any:
        raise TypeError("windows are gathered in batches")

    def cut(self, member: int, phase: int) -> NDArray[np.int64]:
        """Windows (see :func:`window_starts`) in which some target has a weight for a member."""
        starts = window_starts(self.segments, self.stride, phase)
        begin, end = starts[:, 0], starts[:, 0] + self.stride
        n_before = self.n_before[member]
        within = np.maximum(begin, starts[:, 1]), np.minimum(end, starts[:, 2] + 1)
        used: NDArray[np.bool_] = n_before[within[1]] > n_before[within[0]]
        return starts[used]

    def gather(
        self, starts: torch.Tensor, counts: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Inputs and targets of windows (n_members, n_windows, 3), some of which may be padding."""
        # time first, as the stacked networks expect
        start, first, last = starts.unbind(-1)
        wanted = self._offsets + start
        rows = wanted.clamp(first, last)
        valid = (rows == wanted)[self.window :] & counts
        rows += self._first_rows
        # an embedding is a table whose rows are looked up; torch has no faster way
        targets = embedding(rows[self.window :], self.targets)
        targets[..., -1] *= valid
        return embedding(rows, self.inputs).permute(1, 2, 0, 3), targets.permute(1, 2, 0, 3)


class WindowLoader:
    """Batches of windows, gathered at once instead of sample by sample.

    A batch holds one batch of each member. The number of batches is that of all windows of the log,
    so that the data of a member does not depend on the other members: a member with fewer windows
    has smaller batches, padded with windows of weight zero. For training (``generators`` given, one
    per member) the windows come in random order, and each pass cuts the log at another phase, so
    that no alignment of the windows is learned.
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
        data, cuts = self.dataset, []
        for member in range(data.n_members):
            generator = None if self.generators is None else self.generators[member]
            phase = 0 if generator is None else int(generator.integers(data.stride))
            cut = data.cut(member, phase)
            cuts.append(cut if generator is None else generator.permutation(cut))
        lengths = np.array([len(cut) for cut in cuts])[:, None]
        n_batches = min(-(-len(data) // self.batch_size), lengths.max())
        edges = np.arange(n_batches + 1) * lengths // n_batches
        size = np.diff(edges).max()
        padded = np.zeros((data.n_members, lengths.max() + size, 3), dtype=np.int64)
        for own, cut in zip(padded, cuts, strict=True):
            own[: len(cut)] = cut
        chosen = edges[:, :-1, None] + np.arange(size)
        counts = torch.as_tensor(chosen < edges[:, 1:, None], device=data.inputs.device)
        batches = padded[np.arange(data.n_members)[:, None, None], chosen]
        starts = torch.as_tensor(batches, device=data.inputs.device)
        for k in range(n_batches):
            inputs, targets = data.gather(starts[:, k], counts[:, k])
            yield (inputs, targets) if data.n_members > 1 else (inputs[0], targets[0])
