# SPDX-License-Identifier: BSD-3-Clause
"""The rigid-body torque as a Python function that needs NumPy only."""

from __future__ import annotations

import keyword
from typing import Any

from skidyn._exceptions import SkidynError
from skidyn.export._bodies import joint_vector
from skidyn.export._c import joint_terms, printable
from skidyn.rigid_body._scalar import python_function
from skidyn.robots import Robot

_SUMMANDS = {
    "viscous": "VISCOUS * dq",
    "coulomb": "COULOMB * np.sign(dq)",
    "rotor_inertia": "ROTOR_INERTIA * ddq",
    "offset": "OFFSET",
}

_TEMPLATE = '''\
"""Joint torques of a model of {robot}: {terms}. Written by skidyn."""

import numpy as np
from numpy import cos, sin

JOINTS = {joints!r}
{constants}

{columns}

def {name}(q, dq, ddq):
    """Torques of shape (n_samples, {n}), in N m (N for sliding joints).

    q, dq, ddq have shape (n_samples, {n}), in rad, rad/s and rad/s^2 (m for sliding joints).
    """
    q, dq, ddq = (np.asarray(x, dtype=float) for x in (q, dq, ddq))
    columns = _columns(q.T, dq.T, ddq.T)
    tau = np.stack([np.broadcast_to(column, q.shape[:1]) for column in columns], axis=-1)
    return {total}
'''


def python_source(
    robot: Robot,
    *,
    parameters: Any = None,
    viscous: Any = None,
    coulomb: Any = None,
    rotor_inertia: Any = None,
    offset: Any = None,
    blur: Any = None,
    name: str = "inverse_dynamics",
) -> str:
    """Text of a Python module with one function, for feedforward without skidyn.

    Parameters
    ----------
    robot : Robot
        The robot.
    parameters : array-like of shape (n_bodies, 10), default=None
        Identified inertial parameters in place of those of the URDF; written into the text.
    viscous, coulomb : array-like of shape (n_joints,), default=None
        Friction ``viscous * dq + coulomb * sign(dq)``, N m s/rad (N s/m) and N m (N); ``sign(0)``
        is 0. None is no friction.
    rotor_inertia : array-like of shape (n_joints,), default=None
        ``rotor_inertia * ddq``, kg m^2 (kg) on the joint side; None is none.
    offset : array-like of shape (n_joints,), default=None
        Constant torque, N m (N); None is none.
    blur : array-like of shape (n_joints,), default=None
        Speed in rad/s (m/s) below which Coulomb friction fades: ``tanh(dq / blur)`` in place of
        ``sign(dq)``. None is the sign itself.
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
    added = joint_terms(
        robot, viscous=viscous, coulomb=coulomb, rotor_inertia=rotor_inertia, offset=offset
    )
    constants, summands = dict(added), dict(_SUMMANDS)
    if blur is not None:
        constants["blur"] = joint_vector(robot, blur, "blur", None).tolist()
        summands["coulomb"] = "COULOMB * np.tanh(dq / BLUR)"
    return _TEMPLATE.format(
        robot=printable(robot.name),
        terms=", ".join(["rigid bodies", *(name.replace("_", " ") for name in added)]),
        constants="".join(
            f"{key.upper()} = np.array({values})\n" for key, values in constants.items()
        ),
        total=" + ".join(["tau", *(summands[key] for key in added)]),
        joints=robot.joint_names,
        name=name,
        n=robot.n_joints,
        columns=python_function(robot.fixed_program(parameters), "_columns"),
    )
