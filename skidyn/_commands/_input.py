# SPDX-License-Identifier: BSD-3-Clause
"""What the commands read: robots, logs, reports."""

from __future__ import annotations

import argparse
import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from skidyn._commands._output import RECORDED, hashes, working
from skidyn._exceptions import LogWarning, SkidynError

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.rigid_body import RBDRegressor
    from skidyn.robots import Robot


def read_model_and_log(options: argparse.Namespace) -> tuple[RBDRegressor, pd.DataFrame, Any]:
    """The model that the options describe, the log, and its torques."""
    from skidyn._persistence import load_model
    from skidyn.rigid_body import RBDRegressor

    robot = read_robot(options)
    frame = read_frame(options, robot)
    tau = frame[[f"tau{j + 1}" for j in range(robot.n_joints)]].to_numpy()
    if options.model.endswith(".skops"):
        return load_model(options.model), frame, tau
    kinds = [kind.strip() for kind in options.model.split(",") if kind.strip()]
    if "rigid_body" not in kinds:
        raise SkidynError("--model must contain rigid_body; it may add kinds of the catalogue")
    effects = tuple(kind for kind in kinds if kind != "rigid_body")
    model = RBDRegressor(robot, effects, "nominal" if options.nominal else "identified")
    return model, frame, tau


def read_frame(
    options: argparse.Namespace, robot: Robot | None, *, check: bool = True
) -> pd.DataFrame:
    """The log, with the columns, units and gains that the options give."""
    from skidyn.datasets import read_log

    with working("Reading", options):
        return read_log(list(options.logs), robot=robot, check=check, **reading(options))


def reading(options: argparse.Namespace) -> dict[str, Any]:
    """What the options say about how the log is to be read: arguments of ``read_log``."""
    return {
        "columns": json_option("columns", options.columns),
        "units": json_option("units", options.units),
        "drive_gains": json_option("drive-gains", getattr(options, "drive_gains", None)),
        "rate": options.rate,
    }


def covered_joints(options: argparse.Namespace) -> list[str] | None:
    """Joints of the robot that the log covers; None for all."""
    return [name.strip() for name in options.joints.split(",")] if options.joints else None


def read_robot(options: argparse.Namespace) -> Robot:
    from skidyn.robots import Robot

    path = Path(options.urdf)
    if not path.is_file():
        raise SkidynError(f"no file {options.urdf}; --urdf wants the description of the robot")
    return Robot.from_urdf(path, joints=covered_joints(options))


def embedded_robot(name: str) -> Robot:
    from skidyn import datasets

    loader = getattr(datasets, f"load_{name}", None)
    if loader is None or name in ("recording", "demo_log"):
        known = sorted(
            n.removeprefix("load_")
            for n in datasets.__all__
            if n.startswith("load_") and n not in ("load_recording", "load_demo_log")
        )
        raise SkidynError(f"no embedded robot {name!r}; there are {', '.join(known)}")
    robot: Robot = loader()
    return robot


def json_option(name: str, text: str | None) -> Any:
    if text is None:
        return None
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise SkidynError(f"--{name} is not JSON: {error}") from None


def joint_numbers(text: str | None) -> list[int] | None:
    if text is None:
        return None
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise SkidynError(f"{text!r}: joints are numbers from 1, such as 1,4") from None


def recorded_options(options: argparse.Namespace) -> argparse.Namespace:
    """Options of the diagnosis that a report records, with those of this command."""
    try:
        report = json.loads(Path(options.report).read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise SkidynError(f"{options.report} is not a report of skidyn diagnose: {error}") from None
    provenance = report.get("provenance") if isinstance(report, dict) else None
    provenance = provenance if isinstance(provenance, dict) else {}
    recorded = provenance.get("options")
    if not isinstance(recorded, dict) or not {"logs", "urdf"} <= set(recorded):
        raise SkidynError(f"{options.report} records no log; it must come from skidyn diagnose")
    # Nothing else is taken over, least of all where to write.
    recorded = {"model": "rigid_body", "nominal": False} | recorded
    recorded = {name: recorded.get(name) for name in RECORDED}
    for name, value in recorded.items():
        parts = value if name == "logs" and isinstance(value, list) else []
        if not isinstance(value, RECORDED[name]) or not all(isinstance(p, str) for p in parts):
            raise SkidynError(
                f"{options.report}: option {name} of the diagnosis is {value!r}; it must come from "
                "skidyn diagnose"
            )
    known = provenance.get("sha256")
    known = known if isinstance(known, dict) else {}
    for name, digest in hashes([*recorded["logs"], recorded["urdf"]]).items():
        if digest != known.get(name):
            warnings.warn(
                f"{name} has changed since {options.report} was written", LogWarning, stacklevel=2
            )
    return argparse.Namespace(**{**recorded, **vars(options)})
