# SPDX-License-Identifier: BSD-3-Clause
"""Python script that repeats the clicks without a browser."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn.effects import Term
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller


def script(
    model: RBDRegressor,
    clicks: Sequence[tuple[str, int]],
    logs: Sequence[str],
    urdf: str,
    joints: Sequence[str] | None,
    reading: Mapping[str, Any],
    controller: Controller | None = None,
) -> str:
    """Python source that repeats the clicks: kind and joint, from 1, of every addition.

    ``reading`` are further arguments of :func:`skidyn.logs.read_log`, None where not given; the
    torque is computed from the commands of a ``controller`` if there is one.
    """
    effects = ", ".join(_source(e) for e in model.effects)
    only = "" if joints is None else f", joints={list(joints)!r}"
    how = "".join(f", {k}={_plain(v)!r}" for k, v in reading.items() if v is not None)
    gravity = reading.get("gravity")
    turned = "" if gravity is None else f".with_gravity({_plain(gravity)!r})"
    torque = ['tau = log[[f"tau{j + 1}" for j in range(robot.n_joints)]].to_numpy()']
    if controller is not None:
        how += ", needs_torque=False"
        gains = "".join(f", {k}={_plain(v)!r}" for k, v in vars(controller).items())[2:]
        torque = [f"tau = servo_torque(Controller({gains.replace('inf', 'np.inf')}), log)"]
    lines = [
        '"""Repeats the steps made in skidyn explore and prints their held-out errors."""',
        "",
        *(["import numpy as np", ""] if "np." in torque[0] else []),
        "from skidyn import save_model",
        "from skidyn.logs import read_log",
        *(["from skidyn.effects import Term"] if "Term(" in effects else []),
        "from skidyn.explorer import Session",
        "from skidyn.identification import RBDRegressor",
        "from skidyn.robots import Robot",
        *(
            ["from skidyn.simulation import Controller, servo_torque"]
            if controller is not None
            else []
        ),
        "",
        f"robot = Robot.from_file({str(urdf)!r}{only}){turned}",
        f"log = read_log({[str(name) for name in logs]!r}, robot=robot{how})",
        *torque,
        f"session = Session(RBDRegressor(robot, [{effects}]{_changed(model)}), log, tau)",
        *(f"session.add({kind!r}, joint={joint})" for kind, joint in clicks),
        "for step in session.history:",
        '    print(step["added"] or "as given", *step["rmse"])',
        'save_model("model.skops", session.fitted_model())',
        "",
    ]
    return "\n".join(lines)


def _changed(model: RBDRegressor) -> str:
    """Arguments of the model that are not the default ones."""
    defaults = inspect.signature(type(model)).parameters
    return "".join(
        f", {name}={_plain(value)!r}"
        for name, value in model.get_params(deep=False).items()
        if name not in ("robot", "effects") and value != defaults[name].default
    )


def _source(effect: Any) -> str:
    """An effect of the model as Python."""
    if isinstance(effect, Term):
        return f"Term({effect.kind!r}, {effect.joints!r}, {_plain(dict(effect.shape))!r})"
    return repr(effect)


def _plain(value: Any) -> Any:
    """A value whose repr is Python source: NumPy's numbers as Python's."""
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(_plain(v) for v in value)
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    return value
