# SPDX-License-Identifier: BSD-3-Clause
"""A model as a stand-alone C function."""

from __future__ import annotations

import re

from skidyn._exceptions import SkidynError
from skidyn.dynamics import C, renumber, statements
from skidyn.export._files import PathLike, write_files
from skidyn.export._model import StaticModel, static_model
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

_TEMPLATE = """\
/* Joint torques of a model of {robot}: {terms}. Written by skidyn.
 *{left}
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


def c_source(model: RBDRegressor | Robot, *, name: str = "skidyn_inverse_dynamics") -> str:
    """Text of a C function that computes the torques of one sample.

    Parameters
    ----------
    model : RBDRegressor or Robot
        Fitted model, or a robot for the rigid bodies of its description.
    name : str, default="skidyn_inverse_dynamics"
        Name of the function ``void name(const double *q, const double *dq, const double *ddq,
        double *tau)``.

    Returns
    -------
    str
        C99 text; compile with ``-lm``. Effects that are not a function of q, dq and ddq are left out;
        a comment at the top lists them.

    Raises
    ------
    SkidynError
        The name is not a C identifier, or the model is not fitted.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import c_source
    >>> print(c_source(load_planar_arm()).splitlines()[8])
    void skidyn_inverse_dynamics(const double q[2], const double dq[2], const double ddq[2], double tau[2])
    """  # noqa: E501
    return function_text(static_model(model), name)


def write_c(
    model: RBDRegressor | Robot, path: PathLike, *, name: str = "skidyn_inverse_dynamics"
) -> tuple[str, ...]:
    """Write the text of :func:`c_source`, and omitted effects to ``<path>.skidyn.json``.

    Parameters
    ----------
    model : RBDRegressor or Robot
        Fitted model, or a robot for the rigid bodies of its description.
    path : path
        File to write.
    name : str, default="skidyn_inverse_dynamics"
        Name of the function.

    Returns
    -------
    tuple of str
        Names of the effects that the file cannot represent; empty if there are none.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import write_c
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_c(load_planar_arm(), pathlib.Path(folder) / "arm.c")
    ()
    """
    static = static_model(model)
    return write_files(path, function_text(static, name), model, static.left)


def function_text(static: StaticModel, name: str) -> str:
    """A C function of part of a model."""
    if not re.fullmatch(r"[A-Za-z_]\w*", name, flags=re.ASCII):
        raise SkidynError(f"name is {name!r}; expected a C identifier such as 'robot_torque'.")
    robot = static.robot
    lines, outputs = statements(static.program, prefix="const double ", suffix=";", language=C)
    lines += [f"tau[{j}] = {value};" for (j,), value in outputs.items()]
    unused = [x for x in ("q", "dq", "ddq") if not re.search(rf"\b{x}\[", "\n".join(lines))]
    lines[:0] = [f"(void){x};" for x in unused]
    left = "; ".join(static.left_names)
    return _TEMPLATE.format(
        robot=printable(robot.name),
        terms=printable(static.title),
        left=f"\n * Left out: {printable(left)}.\n *" if left else "",
        joints=printable(", ".join(robot.joint_names)),
        name=name,
        n=robot.n_joints,
        body="\n".join(f"    {line}" for line in renumber(lines)),
    )


def printable(text: str) -> str:
    """Text that cannot end a comment, for any names of joints."""
    return re.sub(r"[^\w ,;.\-]", "_", text)
