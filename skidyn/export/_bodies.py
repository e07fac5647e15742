# SPDX-License-Identifier: BSD-3-Clause
"""What URDF and MJCF writers share: central inertias, rotations, the side-car file."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn.rigid_body._tree import inertial_parts, skew
from skidyn.robots import Robot


@dataclass(frozen=True)
class CentralInertia:
    """Mass (kg), center of mass (m) in the body frame, and inertia (kg m^2) about it."""

    mass: float
    center: np.ndarray
    inertia: np.ndarray


def central_inertia(parameters: np.ndarray, body: str) -> CentralInertia | None:
    """Inertia about the center of mass; None for a body without mass.

    Raises
    ------
    SkidynError
        No real body has these parameters, so that neither format can hold them.
    """
    mass, moment, inertia = inertial_parts(parameters)
    if not np.any(parameters):
        return None
    if mass <= 0.0:
        raise SkidynError(
            f"Body {body!r} has a mass of {mass:g} kg; the format needs a positive one. Identify "
            "physically consistent parameters, RBDRegressor(..., consistent=True)."
        )
    center = moment / mass
    arm = skew(center)
    central = inertia + mass * arm @ arm
    moments = np.linalg.eigvalsh(central)
    if moments[0] < -1e-9 * max(abs(moments[-1]), 1e-9):
        raise SkidynError(
            f"Body {body!r} has the principal moments {', '.join(f'{m:.3g}' for m in moments)} kg "
            "m^2 about its center of mass; no real body has a negative one. Identify physically "
            "consistent parameters, RBDRegressor(..., consistent=True)."
        )
    return CentralInertia(mass, center, (central + central.T) / 2)


def parameters_of(robot: Robot, parameters: Any) -> np.ndarray:
    """Given parameters, shape (n_bodies, 10), or those of the URDF."""
    if parameters is None:
        return robot.inertial_parameters
    array = np.asarray(parameters, dtype=np.float64)
    if array.size != 10 * robot.n_bodies or not np.all(np.isfinite(array)):
        raise SkidynError(
            f"parameters has shape {array.shape}; expected ({robot.n_bodies}, 10), all finite."
        )
    return array.reshape(robot.n_bodies, 10)


def joint_vector(robot: Robot, values: Any, what: str, default: np.ndarray | None) -> np.ndarray:
    """One number per joint; zeros or the default where none is given."""
    if values is None:
        return np.zeros(robot.n_joints) if default is None else default
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (robot.n_joints,) or not np.all(np.isfinite(array)):
        raise SkidynError(
            f"{what} has shape {array.shape}; expected one finite number for each of the "
            f"{robot.n_joints} joints."
        )
    return array


def numbers(values: Any) -> str:
    """Numbers as text that reads back to the same doubles."""
    return " ".join(repr(float(value) + 0.0) for value in np.ravel(values))


def write_files(
    path: str | os.PathLike[str], text: str, robot: Robot, not_held: Mapping[str, Any]
) -> tuple[str, ...]:
    """Write the description and, for what it cannot hold, a side-car JSON next to it.

    Each in one step. The side-car keeps the whole name of the file, so that a URDF and an MJCF of
    one robot have one each.

    Returns
    -------
    tuple of str
        Names of what the description does not hold.
    """
    from skidyn.report._write import write_text

    target = Path(path)
    write_text(target, text)
    if not not_held:
        return ()
    content = {
        "schema": "skidyn.sidecar/1",
        "description": target.name,
        "joints": list(robot.joint_names),
        "not_held": {name: _plain(value) for name, value in not_held.items()},
    }
    write_text(f"{target}.skidyn.json", json.dumps(content, indent=2) + "\n")
    return tuple(not_held)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
