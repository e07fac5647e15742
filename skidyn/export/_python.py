# SPDX-License-Identifier: BSD-3-Clause
"""A model as a Python function that needs NumPy only."""

from __future__ import annotations

import keyword
import re

from skidyn._exceptions import SkidynError
from skidyn.dynamics import python_function
from skidyn.export._c import printable
from skidyn.export._files import PathLike, write_files
from skidyn.export._model import StaticModel, static_model
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

_FUNCTIONS = ("abs", "cos", "exp", "maximum", "sign", "sin", "sqrt", "tanh")

_TEMPLATE = '''\
"""Joint torques of a model of {robot}: {terms}.{left} Written by skidyn."""

import numpy as np
{functions}
JOINTS = {joints!r}


{columns}

def {name}(q, dq, ddq):
    """Torques of shape (n_samples, {n}), in N m (N for sliding joints).

    q, dq, ddq have shape (n_samples, {n}), in rad, rad/s and rad/s^2 (m for sliding joints).
    """
    q, dq, ddq = (np.asarray(x, dtype=float) for x in (q, dq, ddq))
    columns = _columns(q.T, dq.T, ddq.T)
    return np.stack([np.broadcast_to(column, q.shape[:1]) for column in columns], axis=-1)
'''


def python_source(model: RBDRegressor | Robot, *, name: str = "inverse_dynamics") -> str:
    """Text of a Python module with one function, for feedforward without skidyn.

    Parameters
    ----------
    model : RBDRegressor or Robot
        Fitted model, or a robot for the rigid bodies of its description.
    name : str, default="inverse_dynamics"
        Name of the function; it takes ``q, dq, ddq`` of shape (n_samples, n_joints).

    Returns
    -------
    str
        Text of the module. Its first line lists the omitted effects, which are not a function of q,
        dq and ddq.

    Raises
    ------
    SkidynError
        The name is not a Python identifier, or the model is not fitted.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import python_source
    >>> namespace = {}
    >>> exec(python_source(load_planar_arm()), namespace)
    >>> namespace["inverse_dynamics"]([[0.5, 0.0]], [[0.0, 0.0]], [[0.0, 0.0]]).round(3)
    array([[5.737, 0.22 ]])
    """
    return _text(static_model(model), name)


def write_python(
    model: RBDRegressor | Robot, path: PathLike, *, name: str = "inverse_dynamics"
) -> tuple[str, ...]:
    """Write the text of :func:`python_source`, and omitted effects to ``<path>.skidyn.json``.

    Parameters
    ----------
    model : RBDRegressor or Robot
        Fitted model, or a robot for the rigid bodies of its description.
    path : path
        File to write.
    name : str, default="inverse_dynamics"
        Name of the function.

    Returns
    -------
    tuple of str
        Names of the effects that the file cannot represent; empty if there are none.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import write_python
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_python(load_planar_arm(), pathlib.Path(folder) / "arm.py")
    ()
    """
    static = static_model(model)
    return write_files(path, _text(static, name), model, static.left)


def _text(static: StaticModel, name: str) -> str:
    if not name.isidentifier() or keyword.iskeyword(name):
        raise SkidynError(f"name is {name!r}; expected a Python identifier such as 'torque'.")
    robot = static.robot
    columns = python_function(static.program, "_columns")
    used = [f for f in _FUNCTIONS if re.search(rf"\b{f}\(", columns)]
    left = "; ".join(static.left_names)
    return _TEMPLATE.format(
        robot=printable(robot.name),
        terms=printable(static.title),
        left=f" Left out: {printable(left)}." if left else "",
        functions=f"from numpy import {', '.join(used)}\n" if used else "",
        joints=tuple(map(str, robot.joint_names)),
        name=name,
        n=robot.n_joints,
        columns=columns,
    )
