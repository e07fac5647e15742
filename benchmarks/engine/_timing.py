# SPDX-License-Identifier: BSD-3-Clause
"""Interleaved timing: ratios from the same minutes of the same process."""

from __future__ import annotations

import os

for _variable in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[_variable] = "1"  # before NumPy and torch read them

import time  # noqa: E402
from collections.abc import Callable  # noqa: E402
from importlib import resources  # noqa: E402

import numpy as np  # noqa: E402
import pinocchio as pin  # noqa: E402

from skidyn.robots import Robot  # noqa: E402

BRANCHED = """
<robot name="branched">
  <link name="base"/>
  {links}
  <joint name="j1" type="revolute"><parent link="base"/><child link="l1"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>{limit}</joint>
  <joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/>
    <origin xyz="0.1 0 0.2" rpy="1.57079632679 0 0"/><axis xyz="0 0 1"/>{limit}</joint>
  <joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>{limit}</joint>
  <joint name="j4" type="prismatic"><parent link="l3"/><child link="l4"/>
    <origin xyz="0.3 0 0" rpy="0 1.57079632679 0"/><axis xyz="0 0 1"/>{limit}</joint>
  <joint name="j5" type="revolute"><parent link="l1"/><child link="l5"/>
    <origin xyz="-0.1 0 0.2" rpy="1.57079632679 0 3.14159265359"/><axis xyz="0 0 1"/>{limit}</joint>
  <joint name="j6" type="revolute"><parent link="l5"/><child link="l6"/>
    <origin xyz="0.4 0 0" rpy="-1.57079632679 0 0"/><axis xyz="0 0 1"/>{limit}</joint>
  <joint name="j7" type="prismatic"><parent link="l6"/><child link="l7"/>
    <origin xyz="0 0 0.3"/><axis xyz="1 0 0"/>{limit}</joint>
</robot>
"""


def branched_text() -> str:
    """URDF of a tree with two sliders and angles written with eleven digits."""
    limit = '<limit lower="-2" upper="2" velocity="3" effort="50"/>'
    rng = np.random.default_rng(0)
    links = [_link(f"l{i}", rng) for i in range(1, 8)]
    return BRANCHED.format(links="".join(links), limit=limit)


def random_tree_text(n_joints: int) -> str:
    """URDF of a tree like a humanoid: a trunk and four limbs, general inertias."""
    rng = np.random.default_rng(n_joints)
    limit = '<limit lower="-2" upper="2" velocity="3" effort="50"/>'
    parts = ['<link name="l0"/>']
    trunk = n_joints // 5
    for i in range(1, n_joints + 1):
        parent = i - 1 if i <= trunk else (trunk if i - trunk <= 4 else i - 4)
        rpy = f"{rng.choice([0, 1.57079632679, -1.57079632679])} 0 0"
        axis = ("1 0 0", "0 1 0", "0 0 1")[rng.integers(3)]
        parts.append(_link(f"l{i}", rng))
        parts.append(
            f'<joint name="j{i}" type="revolute"><parent link="l{parent}"/><child link="l{i}"/>'
            f'<origin xyz="0.1 0 {rng.uniform(0.1, 0.3):.3f}" rpy="{rpy}"/><axis xyz="{axis}"/>'
            f"{limit}</joint>"
        )
    return f'<robot name="tree{n_joints}">{"".join(parts)}</robot>'


def _link(name: str, rng: np.random.Generator) -> str:
    center = " ".join(f"{x:.4f}" for x in rng.uniform(-0.1, 0.1, 3))
    return (
        f'<link name="{name}"><inertial><origin xyz="{center}"/>'
        f'<mass value="{rng.uniform(1, 4):.3f}"/>'
        '<inertia ixx="0.04" ixy="0.003" ixz="-0.002" iyy="0.05" iyz="0.001" izz="0.03"/>'
        "</inertial></link>"
    )


def embedded_text(name: str) -> str:
    """URDF of a robot that comes with skidyn."""
    return resources.files("skidyn.datasets").joinpath("robots", f"{name}.urdf").read_text("utf-8")


def models(text: str) -> tuple[Robot, pin.Model, np.ndarray]:
    """The robot in skidyn, in pinocchio, and pinocchio's velocity index of every joint."""
    robot, model = Robot.from_urdf(text), pin.buildModelFromXML(text)
    order = [model.joints[model.getJointId(name)].idx_v for name in robot.joint_names]
    return robot, model, np.array(order)


def interleaved(functions: dict[str, Callable[[], object]], n_samples: int, rounds: int) -> dict:
    """Best CPU time per sample in microseconds; the functions take turns.

    CPU time, because on a busy machine the clock on the wall also measures the neighbours.
    """
    best = dict.fromkeys(functions, np.inf)
    for function in functions.values():
        function()
    for _ in range(rounds):
        for name, function in functions.items():
            start = time.process_time()
            function()
            best[name] = min(best[name], (time.process_time() - start) / n_samples * 1e6)
    return best
