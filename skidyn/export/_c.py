# SPDX-License-Identifier: BSD-3-Clause
"""The rigid-body torque as a stand-alone C function."""

from __future__ import annotations

import re
from typing import Any

from skidyn._exceptions import SkidynError
from skidyn.export._bodies import joint_vector
from skidyn.rigid_body._source import renumber, statements
from skidyn.robots import Robot

#: What the coefficient of each term is multiplied by.
_FACTORS = {
    "viscous": "dq[{j}]",
    "coulomb": "((dq[{j}] > 0.0) - (dq[{j}] < 0.0))",
    "rotor_inertia": "ddq[{j}]",
    "offset": "1.0",
}

_TEMPLATE = """\
/* Joint torques of a model of {robot}: {terms}. Written by skidyn.
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


def c_source(
    robot: Robot,
    *,
    parameters: Any = None,
    viscous: Any = None,
    coulomb: Any = None,
    rotor_inertia: Any = None,
    offset: Any = None,
    blur: Any = None,
    name: str = "skidyn_inverse_dynamics",
) -> str:
    """Text of a C function that computes the torques of one sample.

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
    added = joint_terms(
        robot, viscous=viscous, coulomb=coulomb, rotor_inertia=rotor_inertia, offset=offset
    )
    factors = dict(_FACTORS)
    widths = None if blur is None else joint_vector(robot, blur, "blur", None).tolist()
    if widths is not None:
        factors["coulomb"] = "tanh(dq[{j}] / {width})"
    for (j,), value in outputs.items():
        width = None if widths is None else widths[j]
        summands = [
            f"{values[j]!r} * {factors[term].format(j=j, width=width)}"
            for term, values in added.items()
        ]
        lines.append(f"tau[{j}] = {' + '.join([value, *summands])};")
    unused = [x for x in ("q", "dq", "ddq") if not re.search(rf"\b{x}\[", "\n".join(lines))]
    lines[:0] = [f"(void){x};" for x in unused]
    return _TEMPLATE.format(
        robot=printable(robot.name),
        terms=", ".join(["rigid bodies", *(name.replace("_", " ") for name in added)]),
        joints=printable(", ".join(robot.joint_names)),
        name=name,
        n=robot.n_joints,
        body="\n".join(f"    {line}" for line in renumber(lines)),
    )


def joint_terms(robot: Robot, **terms: Any) -> dict[str, list[float]]:
    """Coefficients per joint of the terms that are given."""
    return {
        name: joint_vector(robot, values, name, None).tolist()
        for name, values in terms.items()
        if values is not None
    }


def printable(text: str) -> str:
    """Text that cannot end a comment, whatever a URDF calls its joints."""
    return re.sub(r"[^\w ,.\-]", "_", text)
