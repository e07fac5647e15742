# SPDX-License-Identifier: BSD-3-Clause
"""Robots that come with skidyn, written from published parameters."""

from __future__ import annotations

from functools import cache
from importlib import resources

from skidyn.robots import Robot


@cache
def _load(name: str) -> Robot:
    """Robot of an embedded URDF; read only once, since robots are immutable."""
    text = resources.files("skidyn.datasets").joinpath("robots", f"{name}.urdf").read_bytes()
    return Robot.from_urdf(text)


def load_panda() -> Robot:
    """Franka Emika Panda: 7 revolute joints, arm without hand.

    Inertial parameters are the feasible set of [1]_, which reproduces measured torques.

    Returns
    -------
    skidyn.robots.Robot
        Joints ``panda_joint1 .. panda_joint7``; link ``panda_link8`` is the flange.

    References
    ----------
    .. [1] C. Gaz, M. Cognetti, A. Oliva, P. Robuffo Giordano, A. De Luca, "Dynamic identification
           of the Franka Emika Panda robot with retrieval of feasible parameters using
           penalty-based optimization", IEEE Robotics and Automation Letters 4(4), 2019.

    Examples
    --------
    >>> from skidyn.datasets import load_panda
    >>> load_panda().n_joints
    7
    """
    return _load("panda")


def load_ur10e() -> Robot:
    """Universal Robots UR10e: 6 revolute joints, 1.3 m reach.

    Kinematics, masses, centers of mass and inertias are those the manufacturer publishes [1]_.

    Returns
    -------
    skidyn.robots.Robot
        Joints ``shoulder_pan_joint .. wrist_3_joint``; link ``tool0`` is the flange.

    References
    ----------
    .. [1] Universal Robots, "DH parameters for calculations of kinematics and dynamics".

    Examples
    --------
    >>> from skidyn.datasets import load_ur10e
    >>> load_ur10e().joint_names[2]
    'elbow_joint'
    """
    return _load("ur10e")


def load_ur5() -> Robot:
    """Universal Robots UR5: 6 revolute joints, 0.85 m reach.

    Kinematics, masses and centers of mass are those the manufacturer publishes [1]_; inertias are
    the cylinder approximation of its ROS description.

    Returns
    -------
    skidyn.robots.Robot
        Joints ``shoulder_pan_joint .. wrist_3_joint``; link ``tool0`` is the flange.

    References
    ----------
    .. [1] Universal Robots, "DH parameters for calculations of kinematics and dynamics".

    Examples
    --------
    >>> from skidyn.datasets import load_ur5
    >>> load_ur5()
    Robot('ur5', n_joints=6)
    """
    return _load("ur5")


def load_srs_arm() -> Robot:
    """Arm with spherical shoulder, elbow and spherical wrist: 7 revolute joints.

    It has the size of a KUKA LBR iiwa 14 R820 and the rounded inertial estimates of [1]_.

    Returns
    -------
    skidyn.robots.Robot
        Joints ``joint1 .. joint7``; link ``flange`` is the flange.

    References
    ----------
    .. [1] S. Virga, M. Esposito, "iiwa_stack", iiwa_description.

    Examples
    --------
    >>> from skidyn.datasets import load_srs_arm
    >>> load_srs_arm().n_joints
    7
    """
    return _load("srs_arm")


def load_planar_arm() -> Robot:
    """Planar arm with two joints in a vertical plane, hanging down at zero.

    The Pelican prototype, table 5.1 of [1]_.

    Returns
    -------
    skidyn.robots.Robot
        Joints ``joint1`` and ``joint2``.

    References
    ----------
    .. [1] R. Kelly, V. Santibanez, A. Loria, "Control of Robot Manipulators in Joint Space",
           Springer, 2005.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> robot = load_planar_arm()
    >>> bool(abs(robot.gravity_torque([[0.0, 0.0]])).max() < 1e-12)
    True
    """
    return _load("planar_arm")


def load_scara() -> Robot:
    """SCARA: two revolute joints, a vertical slider and a revolute tool axis.

    Geometry of an Adept Cobra s600 from its data sheet; masses are estimates, inertias those of
    uniform boxes and cylinders, because the manufacturer does not publish them.

    Returns
    -------
    skidyn.robots.Robot
        Joints ``joint1 .. joint4``; ``joint3`` is prismatic.

    Examples
    --------
    >>> from skidyn.datasets import load_scara
    >>> load_scara().joint_types
    ('revolute', 'revolute', 'prismatic', 'revolute')
    """
    return _load("scara")
