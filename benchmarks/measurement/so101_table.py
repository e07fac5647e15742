# SPDX-License-Identifier: BSD-3-Clause
"""Whether the SO-101 touches its table, from commanded and measured positions alone.

Usage: python benchmarks/measurement/so101_table.py FOLDER

FOLDER holds one folder for each recording (``state_motor.csv.gz``, ``control.csv.gz``) and
``so101.urdf``. Without contact the arm hangs below its commands, by gravity and the droop of the
servos. Printed are, by recording, by how much the tool is below its commanded height in the middle
of all rows where that is 60 mm or more, and the rows in which tool and command stand, the tool 5 mm
or more above: in how many it is stopped so, its heights, the commanded ones, and the range of the
third joint's angle and the largest magnitude of its torque there.
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import numpy as np

from skidyn.logs import read_log
from skidyn.robots import Robot

#: Height above which the tool is free, and how far above its command it is stopped, m.
FREE, ABOVE = 0.06, 0.005
#: Way of a tool that stands, m, from so many rows before to so many after.
SLOW, ROWS = 0.001, 10


def still(height: np.ndarray) -> np.ndarray:
    """Rows around which a height hardly changes."""
    later, earlier = (np.roll(height, shift) for shift in (-ROWS, ROWS))
    return np.abs(later - earlier) < SLOW


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    warnings.simplefilter("ignore")
    robot = Robot.from_urdf(folder / "so101.urdf")
    print(
        f"{'recording':20s} {'below, free':>11s} {'stopped':>8s} {'height mm':>12s} "
        f"{'commanded mm':>13s} {'joint 3 rad':>13s} {'N m':>5s}"
    )
    for run in sorted(path for path in folder.iterdir() if path.is_dir()):
        log = read_log(run, robot=robot, units={"time": "us"}, check=False)
        height, wanted = (
            robot.forward_kinematics(log[[f"{c}{k + 1}" for k in range(6)]].to_numpy(float))[0][
                :, 2
            ]
            for c in ("q", "cmd")
        )
        free = wanted > FREE
        stopped = (height - wanted > ABOVE) & still(height) & still(wanted)
        below = f"{1e3 * np.median((wanted - height)[free]):11.0f}"
        told = ""
        if stopped.any():
            q = log["q3"].to_numpy()[stopped]
            sizes = (1e3 * height[stopped], 1e3 * wanted[stopped])
            spans = [f"{x.min():.0f} to {x.max():.0f}" for x in sizes]
            told = (
                f"{spans[0]:>12s} {spans[1]:>13s} {f'{q.min():.2f} to {q.max():.2f}':>13s} "
                f"{log['tau3'].abs().to_numpy()[stopped].max():5.2f}"
            )
        print(f"{run.name:20s} {below} {int(stopped.sum()):8d} {told}")


if __name__ == "__main__":
    main()
