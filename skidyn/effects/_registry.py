# SPDX-License-Identifier: BSD-3-Clause
"""Effects by their kind."""

from __future__ import annotations

from skidyn._exceptions import EffectError
from skidyn._text import suggest
from skidyn.effects._base import Effect

_EFFECTS: dict[str, Effect] = {}


def list_effects() -> list[str]:
    """Kinds of the catalogue, without the functions for ``unknown`` effects.

    Returns
    -------
    list of str
        In the order of the catalogue.

    Examples
    --------
    >>> from skidyn.effects import list_effects
    >>> "dahl" in list_effects()
    True
    """
    return [kind for kind, effect in _EFFECTS.items() if not effect.nameless]


def get_effect(kind: str) -> Effect:
    """Effect of a kind.

    Parameters
    ----------
    kind : str
        Name in the catalogue.

    Returns
    -------
    Effect
        The instance in the catalogue.

    Raises
    ------
    EffectError
        The kind does not exist.

    Examples
    --------
    >>> from skidyn.effects import get_effect
    >>> get_effect("stribeck").title
    'Stribeck friction'
    """
    try:
        return _EFFECTS[kind]
    except KeyError:
        raise EffectError(
            f"no effect {kind!r}{suggest(kind, list_effects())}; skidyn effects lists all of them "
            "(in Python: skidyn.effects.list_effects())"
        ) from None


def searched_kinds() -> list[str]:
    """Kinds of the catalogue that are tried if no others are asked for."""
    return [kind for kind in list_effects() if _EFFECTS[kind].automatic]


def nameless_kinds() -> list[str]:
    """Functions for unknown effects, which the diagnosis tries if no known effect fits."""
    return [kind for kind, e in _EFFECTS.items() if e.nameless and e.search != "given"]


def register_effect(effect: Effect | type[Effect]) -> None:
    """Add an effect to the catalogue, for use in diagnosis and reports.

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
    >>> from skidyn.effects import unregister_effect
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
    _EFFECTS[instance.kind] = instance


def unregister_effect(kind: str) -> None:
    """Remove an effect from the catalogue.

    Parameters
    ----------
    kind : str
        Its name; an unknown name is ignored.

    Examples
    --------
    >>> from skidyn.effects import unregister_effect
    >>> unregister_effect("air_drag")
    """
    _EFFECTS.pop(kind, None)
