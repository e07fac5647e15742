# SPDX-License-Identifier: BSD-3-Clause
"""UR10e: payloads from loaded and unloaded runs, and drive gains from a known load.

    SKIDYN_DATA=FOLDER python benchmarks/identification/payload.py

Payloads with the published drive gains times 0.91, which is one factor for all joints and days; the
drive gains, the published set and the estimate of the recordings' authors.
"""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path

import numpy as np

from skidyn.logs import load_recording
from skidyn.payload import estimate_drive_gains, identify_payload
from skidyn.robots import Robot

FOLDER = Path(os.environ.get("SKIDYN_DATA", "no folder given")) / "ur10e"
PUBLISHED = np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
RECORDERS = np.array([10.0, 10.70, 8.46, 9.00, 9.48, 10.12])
#: Loaded run, unloaded runs, mass in kg (None: not written down).
RUNS = (
    ("ur-20_02_19_14harm50secLoad", ("ur-20_02_19_14harm50sec", "ur-20_02_19_15harm50sec"), 2.805),
    ("ur-19_10_29-20_sec_mass", ("ur-19_10_29-20_sec",), 1.069),
    ("ur-19_11_05-20_sec_mass_2", ("ur-19_10_29-20_sec",), 1.069),
    ("ur-20_01_31-load", ("ur-20_01_31-unload",), None),
)


def main() -> None:
    """Print both tables."""
    if not FOLDER.is_dir():
        sys.exit("set SKIDYN_DATA to the folder that holds ur10e/")
    warnings.simplefilter("ignore")
    robot = Robot.from_urdf(FOLDER / "ur10e_min.urdf")
    print(f"{'loaded run':30s}{'kg':>7s}{'published':>11s}{'x 0.91':>9s}{'95 %':>17s}  com, m")
    for loaded, unloaded, mass in RUNS:
        plain = identify_payload(robot, *_read(loaded, unloaded, PUBLISHED))
        found = identify_payload(robot, *_read(loaded, unloaded, 0.91 * PUBLISHED))
        low, high = found.mass_interval
        print(
            f"{loaded:30s}{'-' if mass is None else mass:>7}{plain.mass:11.3f}{found.mass:9.3f}"
            f"{low:9.3f} .. {high:.3f}  " + " ".join(f"{x:.3f}" for x in found.com),
            flush=True,
        )
    print("\ndrive gains in N m/A from 2.805 kg, 95 % intervals, joints 1 to 6")
    found = estimate_drive_gains(robot, *_read(*RUNS[0][:2], np.ones(6)), 2.805)
    for name, values in (
        ("published", PUBLISHED),
        ("recorders' estimate", RECORDERS),
        ("skidyn", found.gains),
        ("  from", found.interval[:, 0]),
        ("  to", found.interval[:, 1]),
        ("skidyn / published", found.gains / PUBLISHED),
    ):
        print(f"{name:22s}" + "".join(f"{v:8.2f}" for v in values))


def _read(loaded: str, unloaded: tuple[str, ...], gains: np.ndarray):
    file = FOLDER / "ur10e_excitation.npz"
    return tuple(
        load_recording(file, run=run, drive_gains=gains).frame for run in (loaded, list(unloaded))
    )


if __name__ == "__main__":
    main()
