# SPDX-License-Identifier: BSD-3-Clause
"""The catalogue: every kind of effect by its name, and how users name terms."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from skidyn._exceptions import EffectError
from skidyn.effects._base import Effect, Term
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
from skidyn.effects._nameless import NAMELESS
from skidyn.effects._position import PositionDependentFriction, TorqueRipple
from skidyn.effects._sensor import Saturation, TimeDelay, TorqueGain
from skidyn.effects._springs import EndStop, GravityCompensator, NonlinearSpring, Offset, Spring
from skidyn.effects._thermal import FrictionDrift, TemperatureFriction, TemperatureOffset
from skidyn.effects._tool import EnvironmentContact, ExternalWrench, Payload
from skidyn.effects._transmission import Backlash, JointElasticity

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
)
_ALL: tuple[type[Effect], ...] = (*_CLASSES, *NAMELESS, Formula)
_CATALOGUE: dict[str, Effect] = {cls.kind: cls() for cls in _ALL}

#: What users may write for a term: a kind, a kind with joints counted from 1, or a Term.
TermSpec = str | tuple[str, Sequence[int]] | Term


def list_effects() -> list[str]:
    """Kinds of the catalogue, without the nameless functions that stand for ``unknown``.

    Returns
    -------
    list of str
        In the order of the catalogue.

    Examples
    --------
    >>> "dahl" in list_effects()
    True
    """
    return [kind for kind, effect in _CATALOGUE.items() if not effect.nameless]


def get_effect(kind: str) -> Effect:
    """Effect of a kind.

    Parameters
    ----------
    kind : str
        Name in the catalogue.

    Returns
    -------
    Effect
        The instance of the catalogue.

    Raises
    ------
    EffectError
        No such kind.

    Examples
    --------
    >>> get_effect("stribeck").title
    'Stribeck friction'
    """
    try:
        return _CATALOGUE[kind]
    except KeyError:
        raise EffectError(
            f"no effect {kind!r}; the catalogue has {', '.join(_CATALOGUE)}"
        ) from None


def nameless_kinds() -> list[str]:
    """Nameless functions that the diagnosis tries when no name fits."""
    return [kind for kind, e in _CATALOGUE.items() if e.nameless and e.search != "given"]


def register_effect(effect: Effect | type[Effect]) -> None:
    """Add your own effect to the catalogue; diagnosis and reports then know it.

    Parameters
    ----------
    effect : Effect or subclass of Effect
        A complete declaration. An effect of the same kind is replaced.

    Raises
    ------
    EffectError
        The declaration is incomplete.

    Examples
    --------
    >>> from skidyn.effects import Coefficient, Effect, list_effects, register_effect
    >>> class AirDrag(Effect):
    ...     kind = "air_drag"
    ...     title = "Air drag"
    ...     formula = "c dq abs(dq)"
    ...     coefficients = (Coefficient("c", "N m s^2/rad^2", sign=1),)
    ...
    ...     def columns(self, signals, joint, **shape):
    ...         dq = signals.dq[:, joint]
    ...         return (dq * abs(dq))[:, None]
    >>> register_effect(AirDrag)
    >>> "air_drag" in list_effects()
    True
    >>> unregister_effect("air_drag")
    """
    instance = effect() if isinstance(effect, type) else effect
    instance.check()
    _CATALOGUE[instance.kind] = instance


def unregister_effect(kind: str) -> None:
    """Take an effect out of the catalogue again."""
    _CATALOGUE.pop(kind, None)


def make_terms(specs: Iterable[TermSpec], n_joints: int) -> list[Term]:
    """Terms from what a user wrote.

    Parameters
    ----------
    specs : iterable of str, (str, joints) or Term
        ``"viscous"`` is viscous friction on every joint; ``("dahl", [1, 4])`` Dahl friction on
        joints 1 and 4, counted from 1; a :class:`Term` stands for itself (joints from 0).
    n_joints : int
        Number of joints of the robot.

    Returns
    -------
    list of Term
        One term per joint for effects that act on single joints.

    Raises
    ------
    EffectError
        Unknown kind, joint out of range, or a pair effect without its pair.

    Examples
    --------
    >>> [str(term) for term in make_terms(["viscous", ("dahl", [2])], 2)]
    ['viscous(joint 1)', 'viscous(joint 2)', 'dahl(joint 2)']
    """
    terms: list[Term] = []
    for spec in specs:
        if isinstance(spec, Term):
            get_effect(spec.kind)
            _check_joints(spec.kind, spec.joints, n_joints)
            terms.append(spec)
            continue
        kind, joints = (spec, None) if isinstance(spec, str) else spec
        terms += _expand(kind, joints, n_joints)
    return terms


def _expand(kind: str, joints: Sequence[int] | None, n_joints: int) -> list[Term]:
    scope = get_effect(kind).scope
    chosen = tuple(range(n_joints)) if joints is None else tuple(int(j) - 1 for j in joints)
    _check_joints(kind, chosen, n_joints)
    if scope == "joint":
        return [Term(kind, (j,)) for j in chosen]
    if scope == "pair" and len(chosen) != 2:
        raise EffectError(f"{kind} couples two joints; write ({kind!r}, [5, 6])")
    return [Term(kind, chosen)]


def _check_joints(kind: str, joints: Sequence[int], n_joints: int) -> None:
    wrong: list[Any] = [j + 1 for j in joints if not 0 <= j < n_joints]
    if wrong:
        raise EffectError(f"{kind}: no joint {wrong[0]}; the robot has joints 1 to {n_joints}")
