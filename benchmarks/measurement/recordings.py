# SPDX-License-Identifier: BSD-3-Clause
"""Suspicions of the checks about public recordings.

Usage: python benchmarks/measurement/recordings.py FOLDER

The folder holds a folder for each robot, with ``*.npz`` and, for some, ``*.urdf``; logs of currents
are read with gains of 1 N m/A.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import numpy as np

from skidyn.exceptions import SkidynError
from skidyn.logs import check_log, read_log
from skidyn.robots import Robot


def main() -> None:
    warnings.simplefilter("ignore")
    for path in sorted(Path(sys.argv[1]).glob("*/*.npz")):
        described = sorted(path.parent.glob("*.urdf"))
        robot = Robot.from_urdf(described[0]) if described else None
        with np.load(path) as stored:
            gains = [1.0] * stored["i"].shape[1] if "tau" not in stored else None
        try:
            frame = read_log(path, robot=robot, drive_gains=gains, missing="drop", check=False)
            checks = check_log(frame, robot).checks
        except SkidynError as error:
            print(f"{path.stem}: {error}", flush=True)
            continue
        print(f"{path.stem}{'' if robot is None else ' with ' + described[0].name}", flush=True)
        for told in checks:
            print(f"    {told.certainty:9s} {told.check}: {told.suspicion}: {told.evidence}")


if __name__ == "__main__":
    main()
