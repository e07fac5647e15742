# SPDX-License-Identifier: BSD-3-Clause
"""Robots of the suite with their drives and motions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources


@dataclass(frozen=True)
class Drives:
    """Drives and motions of a robot; one value per joint, rad (m for sliders), s, N m (N).

    The numbers are typical of the robot's class; they need not be those of a real specimen, since
    truth and log are made from the same ones.
    """

    centre: tuple[float, ...]
    stroke: tuple[float, ...]
    speed: tuple[float, ...]
    acceleration: tuple[float, ...]
    viscous: tuple[float, ...]
    coulomb: tuple[float, ...]
    rotor: tuple[float, ...]
    payload: float
    push: float
    stiffness: tuple[float, ...]
    sliders: tuple[int, ...] = ()

    @property
    def n_joints(self) -> int:
        return len(self.centre)


DRIVES: dict[str, Drives] = {
    "panda": Drives(
        centre=(0, -0.2, 0, -1.7, 0, 1.8, 0),
        stroke=(1.3, 0.9, 1.2, 0.9, 1.3, 1.1, 1.5),
        speed=(1.5, 1.2, 1.5, 1.5, 2, 2, 2.2),
        acceleration=(6, 5, 7, 7, 10, 10, 12),
        viscous=(0.9, 0.9, 0.6, 0.8, 0.45, 0.3, 0.25),
        coulomb=(0.6, 0.8, 0.5, 0.6, 0.45, 0.3, 0.35),
        rotor=(0.6, 0.6, 0.5, 0.5, 0.2, 0.2, 0.2),
        payload=1.6,
        push=12.0,
        stiffness=(3000, 3000, 1000, 1000, 1000, 1000, 1000),
    ),
    "planar_arm": Drives(
        centre=(-0.3, 0.5),
        stroke=(1.2, 1.5),
        speed=(2.5, 3.0),
        acceleration=(12, 16),
        viscous=(0.4, 0.2),
        coulomb=(0.8, 0.4),
        rotor=(0.08, 0.04),
        payload=0.5,
        push=5.0,
        stiffness=(400, 150),
    ),
    "scara": Drives(
        centre=(0, 0.4, -0.105, 0),
        stroke=(1.3, 1.5, 0.08, 1.8),
        speed=(2, 2.4, 0.25, 3),
        acceleration=(10, 12, 1.6, 18),
        viscous=(5, 3.2, 45, 0.35),
        coulomb=(4, 2.5, 14, 0.3),
        rotor=(0.9, 0.5, 8.0, 0.02),
        payload=2.0,
        push=15.0,
        stiffness=(1800, 1800, 90000, 300),
        sliders=(2,),
    ),
    "srs_arm": Drives(
        centre=(0, 0.3, 0, -1.0, 0, 0.7, 0),
        stroke=(1.3, 0.9, 1.2, 1.0, 1.4, 1.1, 1.6),
        speed=(1.5, 1.3, 1.6, 1.7, 2.1, 2.2, 2.4),
        acceleration=(6, 5, 7, 7, 10, 11, 13),
        viscous=(6, 6.5, 4.2, 4, 2.2, 1.2, 0.9),
        coulomb=(5, 5.5, 3.6, 3.4, 1.8, 1.2, 0.8),
        rotor=(1.3, 1.3, 0.7, 0.7, 0.35, 0.2, 0.15),
        payload=4.0,
        push=25.0,
        stiffness=(3500, 3500, 1500, 1500, 1000, 1000, 800),
    ),
    "ur10e": Drives(
        centre=(0, -1.2, 1.3, -0.6, 0.4, 0),
        stroke=(1.4, 0.8, 0.9, 1.4, 1.4, 1.6),
        speed=(1.5, 1.3, 1.6, 2.2, 2.2, 2.2),
        acceleration=(5, 4.5, 6, 10, 10, 10),
        viscous=(17, 18, 12, 3.5, 3.0, 2.8),
        coulomb=(13, 15, 9, 3.0, 2.6, 2.3),
        rotor=(2.1, 2.1, 1.1, 0.18, 0.18, 0.18),
        payload=6.0,
        push=35.0,
        stiffness=(5500, 5500, 2600, 1500, 1500, 1500),
    ),
    "ur5": Drives(
        centre=(0, -1.2, 1.2, -0.6, 0.4, 0),
        stroke=(1.4, 0.9, 1.0, 1.4, 1.4, 1.6),
        speed=(1.8, 1.5, 1.8, 2.5, 2.5, 2.5),
        acceleration=(7, 6, 8, 12, 12, 12),
        viscous=(9, 10, 7, 1.8, 1.6, 1.5),
        coulomb=(7, 9, 6, 1.7, 1.4, 1.2),
        rotor=(0.9, 0.9, 0.5, 0.09, 0.09, 0.09),
        payload=3.0,
        push=20.0,
        stiffness=(3000, 3000, 1500, 1000, 1000, 1000),
    ),
}


@cache
def urdf_of(name: str) -> str:
    """Text of the embedded URDF, which is given to the user."""
    return resources.files("skidyn.datasets").joinpath("robots", f"{name}.urdf").read_text("utf-8")
