# SPDX-License-Identifier: BSD-3-Clause
"""The rigid-body torque as a Python function that needs NumPy only."""

from __future__ import annotations

import keyword
from typing import Any

from skidyn._exceptions import SkidynError
from skidyn.export._c import printable
from skidyn.rigid_body._scalar import python_function
from skidyn.robots import Robot

_TEMPLATE = '''\
"""Joint torques of the rigid-body model of {robot}, without friction. Written by skidyn."""

import numpy as np
from numpy import cos, sin

JOINTS = {joints!r}


{columns}

def {name}(q, dq, ddq):
    """Torques of shape (n_samples, {n}), in N m (N for sliding joints).

    q, dq, ddq have shape (n_samples, {n}), in rad, rad/s and rad/s^2 (m for sliding joints).
    """
    q, dq, ddq = (np.asarray(x, dtype=float).T for x in (q, dq, ddq))
    return np.stack([np.broadcast_to(tau, q[0].shape) for tau in _columns(q, dq, ddq)], axis=-1)
'''


def python_source(robot: Robot, *, parameters: Any = None, name: str = "inverse_dynamics") -> str:
    """Text of a Python module with one function, for feedforward without skidyn.

    Parameters
    ----------
    robot : Robot
        The robot.
    parameters : array-like of shape (n_bodies, 10), default=None
        Identified inertial parameters in place of those of the URDF; written into the text.
    name : str, default="inverse_dynamics"
        Name of the function; it takes ``q, dq, ddq`` of shape (n_samples, n_joints).

    Returns
    -------
    str
        Text of the module.

    Raises
    ------
    SkidynError
        The name is not a Python identifier or the parameters do not fit the robot.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import python_source
    >>> namespace = {}
    >>> exec(python_source(load_planar_arm()), namespace)
    >>> namespace["inverse_dynamics"]([[0.5, 0.0]], [[0.0, 0.0]], [[0.0, 0.0]]).round(3)
    array([[5.737, 0.22 ]])
    """
    if not name.isidentifier() or keyword.iskeyword(name):
        raise SkidynError(f"name is {name!r}; expected a Python identifier such as 'torque'.")
    return _TEMPLATE.format(
        robot=printable(robot.name),
        joints=robot.joint_names,
        name=name,
        n=robot.n_joints,
        columns=python_function(robot.fixed_program(parameters), "_columns"),
    )
