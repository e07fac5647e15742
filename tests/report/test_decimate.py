# SPDX-License-Identifier: BSD-3-Clause
import numpy as np

from skidyn.report import rows_with_peaks


def test_keeps_every_peak_and_the_ends():
    signal = np.sin(np.linspace(0, 60, 30_000))
    signal[12_345], signal[29_998] = 7.0, -5.0
    segments = [slice(0, 10_001), slice(10_001, 30_000)]
    pieces = rows_with_peaks([signal], segments, 500)
    rows = np.concatenate(pieces)
    assert len(rows) < 1600
    assert {0, 10_000, 10_001, 12_345, 29_998, 29_999} <= set(rows.tolist())
    assert (np.diff(rows) > 0).all()
    assert pieces[0].max() == 10_000 and pieces[1].min() == 10_001


def test_every_bucket_keeps_its_extremes():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 1000))
    (rows,) = rows_with_peaks([a, b], [slice(0, 1000)], 50)
    for signal in (a, b):
        for start in range(0, 1000, 20):
            block = signal[start : start + 20]
            inside = signal[rows[(rows >= start) & (rows < start + 20)]]
            assert inside.min() == block.min() and inside.max() == block.max()


def test_short_signals_stay_whole():
    (rows,) = rows_with_peaks([np.arange(10.0)], [slice(0, 10)], 500)
    assert rows.tolist() == list(range(10))
