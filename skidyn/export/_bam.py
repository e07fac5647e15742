# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a servo in the format of the BAM project, read and written."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn._writing import write_json
from skidyn.effects import Term
from skidyn.export._files import PathLike
from skidyn.export._model import check_model, is_lasting, name_term
from skidyn.identification import RBDRegressor

_SPEED = ("dtheta_stribeck", "alpha")
_DIRECTIONAL = ("load_friction_motor", "load_friction_external")
_M5 = (
    *("friction_stribeck", *_DIRECTIONAL),
    *(f"{name}_stribeck" for name in _DIRECTIONAL),
)
#: Friction parameters of every model other than ``friction_base`` and ``friction_viscous``.
BAM_MODELS: dict[str, tuple[str, ...]] = {
    "m1": (),
    "m2": ("friction_stribeck", *_SPEED),
    "m3": ("load_friction_base",),
    "m4": ("friction_stribeck", "load_friction_base", "load_friction_stribeck", *_SPEED),
    "m5": (*_M5, *_SPEED),
    "m6": (*_M5, "load_friction_motor_quad", "load_friction_external_quad", *_SPEED),
}
#: Friction parameters of all models.
ALWAYS = ("friction_base", "friction_viscous")
#: Size of a file beyond which it is refused, bytes.
_LARGEST = 2**20


@dataclass(frozen=True)
class BamModel:
    r"""Friction and motor of a servo, as described by the BAM project [1]_.

    Its models m1 to m6 give the maximum friction torque against the motion,

    .. math:: K_v|\dot q| + K_c + |K_m\tau_m - K_e\tau_e|
       + e^{-|\dot q/\dot q_s|^\alpha}(K_{cs} + |K_{ms}\tau_m - K_{es}\tau_e| + Q)

    with the torque :math:`\tau_m` of the motor and the external torque :math:`\tau_e` (gravity,
    contacts). m1 has the first two terms, m2 adds :math:`K_{cs}`, m3 and m4 have one coefficient
    for both torques, m5 one for each, and m6 adds Q, which is quadratic in the smaller torque where
    the two have opposite signs.

    Parameters
    ----------
    name : {"m1", "m2", "m3", "m4", "m5", "m6"}
        Model.
    actuator : str
        Name of the servo in BAM, such as ``"xl330"``, on which its control law depends.
    parameters : mapping of str to float
        Parameters by BAM's names, SI units: those of friction, ``armature`` (kg m^2), ``kt`` (N
        m/A), ``R`` (ohm) and others of the motor.

    Raises
    ------
    SkidynError
        A parameter of the model's friction is missing, negative or not a number.

    References
    ----------
    .. [1] M. Duclusaud, G. Passault, V. Padois, O. Ly (2024), Extended friction models for the
       physics simulation of servo actuators. Format: github.com/Rhoban/bam, version 1.0.

    Examples
    --------
    >>> from skidyn.export import BamModel
    >>> servo = BamModel("m1", "xl330", {"friction_base": 0.02, "friction_viscous": 0.01})
    >>> servo.friction(0.5, -0.4, [-2.0, 2.0])
    array([-0.04,  0.04])
    """

    name: str
    actuator: str
    parameters: Mapping[str, float]

    def __post_init__(self) -> None:
        for key in friction_parameters(self.name):
            if key not in self.parameters:
                raise SkidynError(f"BAM's model {self.name} needs the parameter {key!r}")
        for key, value in self.parameters.items():
            if not math.isfinite(value):
                raise SkidynError(f"the parameter {key!r} is {value!r}; expected a number")
            if value < 0.0 and key in (*ALWAYS, *BAM_MODELS["m4"], *BAM_MODELS["m6"]):
                raise SkidynError(f"the parameter {key!r} is {value:g}; friction is not negative")

    def friction(self, motor_torque: Any, external_torque: Any, dq: Any) -> Array:
        """Torque of friction while the joint moves, to be overcome by the motor.

        The measured torque of the motor minus friction is the torque of bodies and armature.

        Parameters
        ----------
        motor_torque : array-like, N m
            Torque of the motor.
        external_torque : array-like, N m
            Torque of gravity and contacts on the joint; at rest without friction it is minus that
            of the motor.
        dq : array-like, rad/s
            Velocity; at rest friction may have any value up to its maximum, and 0 is returned.

        Returns
        -------
        ndarray
            N m, with the sign of dq.
        """
        motor, outside, speed = np.broadcast_arrays(
            *(np.asarray(x, dtype=float) for x in (motor_torque, external_torque, dq))
        )
        return np.asarray(
            np.sign(speed) * friction_budget(self.name, self.parameters, motor, outside, speed)
        )


def friction_parameters(name: str) -> tuple[str, ...]:
    """Friction parameters of a model; raises an error if BAM has no model of this name."""
    if name not in BAM_MODELS:
        raise SkidynError(f"name is {name!r}; BAM has the models {', '.join(BAM_MODELS)}")
    return *ALWAYS, *BAM_MODELS[name]


def motor_constants(motor: Mapping[str, float] | None) -> dict[str, float]:
    """Numbers by name for a file, other than those of friction."""
    given = {} if motor is None else motor
    if not isinstance(given, Mapping) or not all(
        isinstance(v, int | float) and not isinstance(v, bool) for v in given.values()
    ):
        raise SkidynError(f"motor is {motor!r}; expected numbers by name, such as kt and R")
    return dict(given)


def checked_actuator(actuator: str | None) -> str:
    """Name of the servo, which is required because BAM's control law depends on it."""
    if not isinstance(actuator, str):
        given = "missing" if actuator is None else repr(actuator)
        raise SkidynError(f"actuator is {given}: the name of the servo in BAM, such as 'xl330'")
    return actuator


def friction_budget(
    name: str, values: Mapping[str, Any], motor: Array, outside: Array, speed: Array
) -> Array:
    """Largest torque of friction, N m."""

    def load(suffix: str) -> Any:
        """Contribution of the torques in the gear to friction."""
        if f"load_friction_motor{suffix}" in BAM_MODELS[name]:
            own = values[f"load_friction_motor{suffix}"] * motor
            return np.abs(values[f"load_friction_external{suffix}"] * outside - own)
        key = f"load_friction{suffix or '_base'}"
        return values[key] * np.abs(outside - motor) if key in BAM_MODELS[name] else 0.0

    size = values["friction_base"] + values["friction_viscous"] * np.abs(speed) + load("")
    if "alpha" not in BAM_MODELS[name]:
        return np.asarray(size)
    slow = values["friction_stribeck"] + load("_stribeck")
    if name == "m6":
        quadratic = np.where(
            np.abs(outside) < np.abs(motor),
            values["load_friction_external_quad"] * outside**2,
            values["load_friction_motor_quad"] * motor**2,
        )
        apart = (np.sign(outside) != np.sign(motor)) & (np.abs(outside) != np.abs(motor))
        slow = slow + quadratic * apart
    fade = np.exp(-((np.abs(speed) / values["dtheta_stribeck"]) ** values["alpha"]))
    return np.asarray(size + fade * slow)


def read_bam(path: str | os.PathLike[str]) -> BamModel:
    """Read the parameters of a servo from a file of BAM.

    Parameters
    ----------
    path : path
        JSON file of BAM's, of a model m1 to m6.

    Returns
    -------
    BamModel
        Model with all numbers of the file.

    Raises
    ------
    SkidynError
        The file is not of this format, or lacks a parameter.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.export import BamModel, read_bam, write_bam
    >>> own = BamModel("m1", "xl330", {"friction_base": 0.02, "friction_viscous": 0.01})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = write_bam(own, pathlib.Path(folder) / "m1.json")
    ...     read_bam(pathlib.Path(folder) / "m1.json") == own
    True
    """
    file = Path(path)
    if file.stat().st_size > _LARGEST:
        raise SkidynError(f"{file} is larger than {_LARGEST >> 20} MiB; expected BAM's parameters")
    try:
        content = json.loads(file.read_text("utf-8"))
    except ValueError as error:
        raise SkidynError(f"{file} is not JSON: {error}") from None
    if not isinstance(content, dict) or not {"model", "actuator"} <= content.keys():
        raise SkidynError(f"{file} lacks 'model' and 'actuator', which BAM's parameters have")
    name, actuator = str(content.pop("model")), str(content.pop("actuator"))
    wrong = [k for k, v in content.items() if isinstance(v, bool) or not isinstance(v, int | float)]
    if wrong:
        raise SkidynError(f"{file}: {wrong[0]!r} is {content[wrong[0]]!r}; expected a number")
    try:
        return BamModel(name, actuator, {k: float(v) for k, v in content.items()})
    except SkidynError as error:
        raise SkidynError(f"{file}: {error}") from None


def write_bam(
    model: RBDRegressor | BamModel,
    path: PathLike,
    *,
    joint: str | int | None = None,
    actuator: str | None = None,
    motor: Mapping[str, float] | None = None,
) -> tuple[str, ...]:
    """Write the friction of a joint in the format of BAM.

    Viscous and Coulomb friction become BAM's model m1, with Stribeck friction m2; rotor inertia is
    ``armature``. Friction that grows with the load and the motor's own torque becomes m3
    (``motor_load_friction``), m4 (``stribeck_load_friction``), m5 (``directional_load_friction``)
    or m6 (``quadratic_load_friction``). ``load_dependent_friction``, which depends on the torque of
    the bodies alone, is left out, since BAM has no such model.

    Parameters
    ----------
    model : RBDRegressor or BamModel
        Fitted model, or the result of :func:`read_bam` or :func:`fit_bam`.
    path : path
        File to write.
    joint : str or int, optional
        Joint of a fitted model, by name or counted from 1; not needed if there is one.
    actuator : str, optional
        Name of the servo in BAM; needed for a fitted model.
    motor : mapping of str to float, optional
        Constants of the motor, which the torque does not determine: ``kt`` (N m/A), ``R`` (ohm) and
        further constants of BAM's servo. BAM uses its own values for missing ones.

    Returns
    -------
    tuple of str
        Names of the effects of the joint that the file cannot represent.

    Raises
    ------
    SkidynError
        The joint is unknown or prismatic, its friction is negative, or no actuator is named.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.export import read_bam, write_bam
    >>> from skidyn.identification import RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), None)
    >>> model = RBDRegressor(log.robot, consistent=True).fit(log.X, log.y)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "m1.json"
    ...     left = write_bam(model, file, joint="joint1", actuator="mx64", motor={"kt": 1.6})
    ...     read_bam(file).name
    'm1'
    """
    left: tuple[str, ...] = ()
    if isinstance(model, BamModel):
        if joint is not None or actuator is not None or motor is not None:
            raise SkidynError("joint, actuator and motor are for a fitted model, not a BamModel")
    else:
        model, left = _of_joint(model, joint, checked_actuator(actuator), motor_constants(motor))
    write_json(path, {**model.parameters, "model": model.name, "actuator": model.actuator})
    return left


def joint_place(robot: Any, joint: str | int | None) -> int:
    """Index of a rotary joint in arrays, by its name or its number from 1."""
    names = list(robot.joint_names)
    if joint is None and len(names) == 1:
        joint = 1
    number = names.index(joint) + 1 if isinstance(joint, str) and joint in names else joint
    if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= len(names):
        raise SkidynError(
            f"joint is {joint!r}; expected one of {', '.join(names)}, or its number from 1"
        )
    if robot.joint_types[number - 1] == "prismatic":
        raise SkidynError(f"{names[number - 1]} is prismatic; BAM's servos are revolute")
    return number - 1


def _of_joint(
    model: RBDRegressor, joint: str | int | None, actuator: str, motor: Mapping[str, float]
) -> tuple[BamModel, tuple[str, ...]]:
    """Parameters of a joint in BAM's m1 to m6, and names of the joint's other effects."""
    check_model(model)
    if not isinstance(model, RBDRegressor):
        raise SkidynError("BAM's format holds friction; give a fitted RBDRegressor or a BamModel")
    number = joint_place(model.robot_, joint)
    values = {"armature": 0.0, "friction_base": 0.0, "friction_viscous": 0.0}
    places = {
        "rotor_inertia": "armature",
        "coulomb": "friction_base",
        "viscous": "friction_viscous",
    }
    left, name = [], "m1"
    for term in model.effect_terms_:
        if number not in term.places:
            continue
        sizes = list(map(float, model.effect_coefficients_[term]))
        own = _LOADED.get(term.kind, "m2" if term.kind == "stribeck" else "")
        if term.kind in places and is_lasting(term):
            values[places[term.kind]] += sizes[0]
        elif own and name == "m1" and is_lasting(term) and "lorentzian" not in term.shape:
            name, values = own, values | _loaded(term, sizes)
        else:
            left.append(name_term(model.robot_, term))
    return BamModel(name, actuator, {**values, **motor}), tuple(left)


#: Models of BAM by the effects of the catalogue that are their friction of the load.
_LOADED = {
    "motor_load_friction": "m3",
    "stribeck_load_friction": "m4",
    "directional_load_friction": "m5",
    "quadratic_load_friction": "m6",
}


def _loaded(term: Term, sizes: list[float]) -> dict[str, float]:
    """Parameters of m2 to m6 other than those of all models, from the effect of a joint."""
    shape = {name: float(value) for name, value in term.shape.items() if value is not None}
    if term.kind == "motor_load_friction":
        return {"load_friction_base": sizes[0]}
    exponent = shape["delta" if term.kind == "stribeck" else "alpha"]
    values = {
        "friction_stribeck": sizes[0],
        "dtheta_stribeck": shape["vs"],
        "alpha": exponent,
    }
    if term.kind == "stribeck_load_friction":
        values |= {"load_friction_base": sizes[1], "load_friction_stribeck": sizes[2]}
    elif term.kind != "stribeck":
        shares = (shape["outside"], shape["slow_outside"])
        for end, size, share in zip(("", "_stribeck"), sizes[1:3], shares, strict=True):
            values[f"load_friction_motor{end}"] = size * (1.0 - share)
            values[f"load_friction_external{end}"] = size * share
    if term.kind == "quadratic_load_friction":
        values |= {"load_friction_motor_quad": sizes[3], "load_friction_external_quad": sizes[4]}
    return values
