# SPDX-License-Identifier: BSD-3-Clause
"""The catalogue of all effects of the package, and the notation of terms for users."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from skidyn._exceptions import EffectError
from skidyn._joint_numbers import joint_numbers
from skidyn._text import joints_of, joints_told
from skidyn.effects._base import Effect
from skidyn.effects._coupling import CoupledFriction, CoupledInertia, CouplingSpring
from skidyn.effects._formula import Formula
from skidyn.effects._friction import (
    AsymmetricFriction,
    Coulomb,
    NonlinearViscous,
    Stribeck,
    Viscous,
)
from skidyn.effects._gravity import BaseTilt
from skidyn.effects._hysteresis import Dahl, LuGre, MaxwellSlip
from skidyn.effects._inertia import RotorInertia
from skidyn.effects._load import LoadDependentFriction
from skidyn.effects._motor_load import MOTOR_LOAD
from skidyn.effects._nameless import NAMELESS
from skidyn.effects._nameless_coupled import COUPLED
from skidyn.effects._nameless_history import HISTORY
from skidyn.effects._nameless_periodic import PERIODIC
from skidyn.effects._nameless_products import PRODUCTS
from skidyn.effects._nameless_signals import OF_SIGNALS
from skidyn.effects._nameless_tool import AT_TOOL
from skidyn.effects._position import PositionDependentFriction, TorqueRipple
from skidyn.effects._registry import get_effect, register_effect
from skidyn.effects._sensor import Saturation, TimeDelay, TorqueGain
from skidyn.effects._servo import SERVO
from skidyn.effects._springs import EndStop, GravityCompensator, NonlinearSpring, Offset, Spring
from skidyn.effects._term import Term
from skidyn.effects._thermal import FrictionDrift, TemperatureFriction, TemperatureOffset
from skidyn.effects._tool import EnvironmentContact, ExternalWrench, Payload
from skidyn.effects._transmission import AccelerationNoise, Backlash, JointElasticity

_CLASSES: tuple[type[Effect], ...] = (
    Viscous,
    Coulomb,
    Offset,
    Stribeck,
    AsymmetricFriction,
    NonlinearViscous,
    LoadDependentFriction,
    TemperatureFriction,
    FrictionDrift,
    Dahl,
    LuGre,
    MaxwellSlip,
    PositionDependentFriction,
    CoupledFriction,
    RotorInertia,
    CoupledInertia,
    CouplingSpring,
    Payload,
    BaseTilt,
    Spring,
    NonlinearSpring,
    GravityCompensator,
    JointElasticity,
    Backlash,
    EndStop,
    TorqueGain,
    TimeDelay,
    Saturation,
    TorqueRipple,
    TemperatureOffset,
    ExternalWrench,
    EnvironmentContact,
    *MOTOR_LOAD,
    *SERVO,
)
_NAMELESS = (*NAMELESS, *OF_SIGNALS, *PRODUCTS, *PERIODIC, *HISTORY, *AT_TOOL, *COUPLED)
for _cls in (*_CLASSES, *_NAMELESS, AccelerationNoise, Formula):
    register_effect(_cls)

#: What users may write for a term: a kind, a kind with joints counted from 1, or a Term.
TermSpec = str | tuple[str, Sequence[int]] | Term


def make_terms(specs: Iterable[TermSpec], n_joints: int) -> list[Term]:
    """Make terms from a user's specification.

    Parameters
    ----------
    specs : iterable of str, (str, joints) or Term
        ``"viscous"`` is viscous friction on every joint; ``("dahl", [1, 4])`` Dahl friction on
        joints 1 and 4, counted from 1; a :class:`Term` is used as given, completed by the shape
        parameters that have a usual value.
    n_joints : int
        Number of joints of the robot.

    Returns
    -------
    list of Term
        One term per joint for effects that act on single joints.

    Raises
    ------
    EffectError
        Unknown kind, joint out of range, a pair effect without its pair, or a setting of a servo.

    Examples
    --------
    >>> [str(term) for term in make_terms(["viscous", ("dahl", [2])], 2)]
    ['viscous(joint 1)', 'viscous(joint 2)', 'dahl(joint 2)']
    """
    if isinstance(specs, str):
        raise EffectError(f"effects={specs!r} is one word; write a list, effects=[{specs!r}]")
    if not isinstance(specs, Iterable):
        raise EffectError(f"effects={specs!r}; expected a list, such as ['viscous', 'coulomb']")
    terms: list[Term] = []
    for spec in specs:
        if isinstance(spec, Term):
            _refuse_settings(get_effect(spec.kind))  # also refuses an unknown kind
            _check_joints(spec.kind, spec.places, n_joints)
            terms.append(_completed(spec))
            continue
        kind, joints = (spec, None) if isinstance(spec, str) else _kind_and_joints(spec)
        terms += _expand(kind, joints, n_joints)
    return terms


def make_new_terms(spec: TermSpec, known: Iterable[TermSpec], n_joints: int) -> list[Term]:
    """As :func:`make_terms`, for an addition to a model with known effects.

    Raises
    ------
    EffectError
        Also if the model has the effect already, in all recordings.
    """
    terms = make_terms([spec], n_joints)
    had = {
        (term.kind, frozenset(term.joints)) for term in make_terms(known, n_joints) if not term.when
    }
    twice = [term for term in terms if (term.kind, frozenset(term.joints)) in had]
    if twice:
        where = joints_told(sorted({joint for term in twice for joint in term.joints}))
        raise EffectError(
            f"the model has {twice[0].kind} on these joints already: {where}; add it on other "
            "joints, or add another effect"
        )
    return terms


def _completed(term: Term) -> Term:
    """Complete the shape of a term by the parameters that have one usual value."""
    if term.is_open:
        return term
    shapes = (s for s in term.effect.shapes if len(s.grid) == 1 and s.name not in term.shape)
    usual = {shape.name: shape.grid[0] for shape in shapes}
    return term.with_shape(**usual) if usual else term


def _kind_and_joints(spec: Any) -> tuple[str, list[int]]:
    """Kind and joints of a pair given by a user."""
    try:
        kind, joints = spec
        if isinstance(kind, str):
            return kind, joint_numbers(joints)
    except (TypeError, ValueError):  # not a pair, or not numbers of joints
        pass
    raise EffectError(
        f"{spec!r} is not an effect; write 'viscous', or ('dahl', [1, 4]) with joints counted from "
        "1, or a Term"
    )


def _expand(kind: str, joints: Sequence[int] | None, n_joints: int) -> list[Term]:
    _refuse_settings(get_effect(kind))
    scope = get_effect(kind).scope
    chosen = tuple(range(n_joints)) if joints is None else tuple(j - 1 for j in joints)
    _check_joints(kind, chosen, n_joints)
    if scope == "joint":
        return [Term.at(kind, (j,)) for j in chosen]
    if scope == "pair" and n_joints < 2:
        raise EffectError(f"{kind} couples two joints; the robot has {joints_of(n_joints)}")
    if scope == "pair" and len(chosen) != 2:
        raise EffectError(
            f"{kind} couples two joints; name both: skidyn add --joints 1,2 (in Python: "
            f"({kind!r}, [1, 2]))"
        )
    return [Term.at(kind, chosen)]


def _refuse_settings(effect: Effect) -> None:
    if not effect.of_servo:
        return
    names = [c.name for c in effect.coefficients]
    raise EffectError(
        f"{effect.kind} is a setting of the servo and no torque of the model; state it in "
        f"--controller (in Python: Controller(..., {', '.join(f'{name}=...' for name in names)}))"
    )


def _check_joints(kind: str, joints: Sequence[int], n_joints: int) -> None:
    wrong: list[Any] = [j + 1 for j in joints if not 0 <= j < n_joints]
    if wrong:
        raise EffectError(f"{kind}: no joint {wrong[0]}; the robot has {joints_of(n_joints)}")
