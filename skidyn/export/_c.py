# SPDX-License-Identifier: BSD-3-Clause
"""The rigid-body torque as a stand-alone C function."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn.rigid_body._source import renumber, statements
from skidyn.robots import Robot

_TEMPLATE = """\
/* Joint torques of the rigid-body model of {robot}, without friction. Written by skidyn.
 *
 * Joints: {joints}.
 * q in rad or m, dq in rad/s or m/s, ddq in rad/s^2 or m/s^2; tau in N m, in N for sliding joints.
 * Needs the C standard library only; no memory is allocated and no state is kept.
 */
#include <math.h>

void {name}(const double q[{n}], const double dq[{n}], const double ddq[{n}], double tau[{n}])
{{
{body}
}}
"""


def c_source(robot: Robot, *, parameters: Any = None, name: str = "skidyn_inverse_dynamics") -> str:
    """Text of a C function that computes the torques of one sample.

    Parameters
    ----------
    robot : Robot
        The robot.
    parameters : array-like of shape (n_bodies, 10), default=None
        Identified inertial parameters in place of those of the URDF; written into the text.
    name : str, default="skidyn_inverse_dynamics"
        Name of the function ``void name(const double *q, const double *dq, const double *ddq,
        double *tau)``.

    Returns
    -------
    str
        C99 text; compile with ``-lm``.

    Raises
    ------
    SkidynError
        The name is not a C identifier or the parameters do not fit the robot.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import c_source
    >>> print(c_source(load_planar_arm()).splitlines()[8])
    void skidyn_inverse_dynamics(const double q[2], const double dq[2], const double ddq[2], double tau[2])
    """  # noqa: E501
    if not re.fullmatch(r"[A-Za-z_]\w*", name, flags=re.ASCII):
        raise SkidynError(f"name is {name!r}; expected a C identifier such as 'robot_torque'.")
    program = robot.fixed_program(parameters)
    lines, outputs = statements(program, prefix="const double ", suffix=";")
    lines += [f"tau[{key[0]}] = {value};" for key, value in outputs.items()]
    unused = [x for x in ("q", "dq", "ddq") if not re.search(rf"\b{x}\[", "\n".join(lines))]
    lines[:0] = [f"(void){x};" for x in unused]
    return _TEMPLATE.format(
        robot=printable(robot.name),
        joints=printable(", ".join(robot.joint_names)),
        name=name,
        n=robot.n_joints,
        body="\n".join(f"    {line}" for line in renumber(lines)),
    )


def printable(text: str) -> str:
    """Text that cannot end a comment, whatever a URDF calls its joints."""
    return re.sub(r"[^\w ,.\-]", "_", text)


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
