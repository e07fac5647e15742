# SPDX-License-Identifier: BSD-3-Clause
"""Diagnoses of logs that were damaged, compared with those of the same logs as they were.

    python benchmarks/diagnosis/damaged.py CASES [--seed 0] [--jobs 2] [--only NAME ...]

Every case is a folder as for ``practice.py``. Each log is damaged in every way below, in a few
moments of the motion or at the ends of its recordings, and diagnosed with default options. Counted
are answers that are the same as those of the log as it was; those with a part of its names; those
that, instead or in addition, tell an unknown or an intermittent torque; logs that are refused; and
answers with the name of an effect that the log as it was does not have.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
from practice import answer
from scipy.ndimage import gaussian_filter1d
from scipy.signal import butter, sosfiltfilt

#: Columns of every quantity that a log may contain.
QUANTITIES = ("q", "dq", "ddq", "tau")


def columns(frame: pd.DataFrame, *quantities: str) -> list[str]:
    """Columns of all joints."""
    names = [f"{quantity}{k}" for quantity in quantities for k in range(1, len(frame.columns))]
    return [name for name in names if name in frame]


def moments(
    frame: pd.DataFrame, rng: np.random.Generator, count: int, seconds: float
) -> list[slice]:
    """Rows of some moments of so many seconds, none of which reaches over two recordings."""
    step = float(np.median(np.diff(frame["time"])))
    length = max(2, round(seconds / step))
    number, found = frame["trajectory"].to_numpy(), []
    while len(found) < count:
        start = int(rng.integers(5, len(frame) - length - 5))
        if number[start - 5] == number[start + length + 5]:
            found.append(slice(start, start + length))
    return found


def held_packets(frame: pd.DataFrame, rng: np.random.Generator) -> None:
    """Eight moments of 60 ms in which all values are those of the last packet."""
    for rows in moments(frame, rng, 8, 0.06):
        here = frame.index[rows]
        frame.loc[here, columns(frame, *QUANTITIES)] = frame.loc[
            here[0], columns(frame, *QUANTITIES)
        ].to_numpy()


def wrong_positions(frame: pd.DataFrame, rng: np.random.Generator) -> None:
    """Four single positions that are off by 2 % of the range."""
    for rows in moments(frame, rng, 4, 0.0):
        name = str(rng.choice(columns(frame, "q")))
        frame.loc[frame.index[rows.start], name] += 0.02 * np.ptp(frame[name])


def zero_positions(frame: pd.DataFrame, rng: np.random.Generator) -> None:
    """Four moments of 40 ms in which a position is 0."""
    name = str(rng.choice(columns(frame, "q")))
    for rows in moments(frame, rng, 4, 0.04):
        frame.loc[frame.index[rows], name] = 0.0


def wrong_torques(frame: pd.DataFrame, rng: np.random.Generator) -> None:
    """Six single torques that are off by up to three standard deviations."""
    for rows in moments(frame, rng, 6, 0.0):
        name = str(rng.choice(columns(frame, "tau")))
        frame.loc[frame.index[rows.start], name] += rng.uniform(-3, 3) * frame[name].std()


def zero_torques(frame: pd.DataFrame, rng: np.random.Generator) -> None:
    """Four moments of 40 ms in which the torque of a joint is 0."""
    name = str(rng.choice(columns(frame, "tau")))
    for rows in moments(frame, rng, 4, 0.04):
        frame.loc[frame.index[rows], name] = 0.0


def bent_ends(frame: pd.DataFrame, rng: np.random.Generator) -> None:
    """All signals filtered by a Gaussian of 20 ms that continues the last value at the ends."""
    for _, own in frame.groupby("trajectory"):
        width = 0.02 / float(np.median(np.diff(own["time"])))
        for name in columns(frame, *QUANTITIES):
            frame.loc[own.index, name] = gaussian_filter1d(own[name], width, mode="nearest")


def low_pass(frame: pd.DataFrame, rng: np.random.Generator) -> None:
    """All signals filtered at 15 Hz, forwards and backwards."""
    for _, own in frame.groupby("trajectory"):
        rate = 1 / float(np.median(np.diff(own["time"])))
        sections = butter(2, min(15.0, 0.4 * rate), fs=rate, output="sos")
        for name in columns(frame, *QUANTITIES):
            frame.loc[own.index, name] = sosfiltfilt(sections, own[name])


def pushes(frame: pd.DataFrame, rng: np.random.Generator) -> None:
    """Three moments of 30 ms with a torque of one standard deviation."""
    for rows in moments(frame, rng, 3, 0.03):
        name = str(rng.choice(columns(frame, "tau")))
        frame.loc[frame.index[rows], name] += rng.choice([-1, 1]) * frame[name].std()


DAMAGES: tuple[Callable[[pd.DataFrame, np.random.Generator], None], ...] = (
    held_packets,
    wrong_positions,
    zero_positions,
    wrong_torques,
    zero_torques,
    bent_ends,
    low_pass,
    pushes,
)


def names(answered: dict) -> dict[str, set[int]]:
    """Joints of every kind of effect."""
    return {
        kind: {j for e in answered["effects"] if e["kind"] == kind for j in e["joints"]}
        for kind in {e["kind"] for e in answered["effects"]}
    }


def verdict(whole: dict, damaged: dict | None) -> str:
    """How the answer to a damaged log compares with that to the log as it was."""
    if damaged is None:
        return "refused"
    was, now = names(whole), names(damaged)
    if was == now:
        return "same"
    if any(not joints <= was.get(kind, set()) for kind, joints in now.items() if kind != "unknown"):
        return "other name"
    return "part" if set(now) <= set(was) else "unknown"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", nargs="+", default=[damage.__name__ for damage in DAMAGES])
    options = parser.parse_args()
    cases = sorted(path for path in options.cases.iterdir() if path.is_dir())
    used = [damage for damage in DAMAGES if damage.__name__ in options.only]

    def told(case: Path, folder: Path) -> dict | None:
        kept = folder / f"{case.name}.json"
        answered = answer(case, folder)
        return answered if kept.exists() else None

    with tempfile.TemporaryDirectory() as place, ThreadPoolExecutor(options.jobs) as pool:
        folder = Path(place)

        def work(task: tuple[int, Path, int | None]) -> dict | None:
            number, case, way = task
            if way is None:
                return told(case, folder)
            damage = used[way]
            copy = folder / f"{case.name}_{damage.__name__}"
            shutil.copytree(case, copy)
            frame = pd.read_parquet(case / "log.parquet")
            frame = frame.astype(dict.fromkeys(columns(frame, *QUANTITIES), float))
            damage(frame, np.random.default_rng([options.seed, number, way]))
            frame.to_parquet(copy / "log.parquet")
            return told(copy, folder)

        tasks = [
            (i, case, way) for i, case in enumerate(cases) for way in (None, *range(len(used)))
        ]
        answers = list(pool.map(work, tasks))
        width = len(used) + 1
        table: dict[str, list[str]] = {damage.__name__: [] for damage in used}
        sure = 0
        for i, _ in enumerate(cases):
            whole, *damaged = answers[i * width : (i + 1) * width]
            assert whole is not None
            for damage, one in zip(used, damaged, strict=True):
                table[damage.__name__].append(verdict(whole, one))
                if one is None:
                    continue
                report = json.loads((folder / f"{one['case']}.json").read_text())
                sure += sum(
                    e["kind"] != "unknown"
                    and (e["confidence"] or 0) >= 0.9
                    and e["kind"] not in names(whole)
                    for e in report["effects"]
                )
    kinds = ("same", "part", "unknown", "refused", "other name")
    print(f"{'damage':18s}" + "".join(f"{kind:>12s}" for kind in kinds))
    for damage in used:
        found = table[damage.__name__]
        print(f"{damage.__name__:18s}" + "".join(f"{found.count(kind):12d}" for kind in kinds))
    print(f"other names at .9 or more: {sure}")


if __name__ == "__main__":
    main()
