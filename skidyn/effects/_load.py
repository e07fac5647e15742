# SPDX-License-Identifier: BSD-3-Clause
"""Friction that grows with the transmitted torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient, Shape

#: Velocity of a joint that moves, as a share of its largest, and least share of these samples in
#: which the load moves the joint.
MOVES, DRIVEN = 0.05, 0.05


def _carried(signals: Signals, joint: int, shape: Mapping[str, Any]) -> Array:
    """Torque that the gear transmits, with the drive's own friction, damping and inertia."""
    if "gravity" in shape:
        return _held(signals)[:, joint]
    assert signals.load is not None
    dry = shape.get("friction", 0.0) * signals.sign[:, joint]
    viscous = shape.get("damping", 0.0) * signals.dq[:, joint]
    rotor = shape.get("inertia", 0.0) * signals.ddq[:, joint]
    carried: Array = signals.load[:, joint] + dry + viscous + rotor
    return carried


def _held(signals: Signals) -> Array:
    """Torque that holds the described bodies at rest, (n_samples, n_joints), N m or N."""
    robot = signals.robot
    assert robot is not None
    held: Array = signals.once("gravity torque", lambda: robot.gravity_torque(signals.q))
    return held


class LoadDependentFriction(Effect):
    """Gear friction that grows with the transmitted torque, or with another ``power`` of it.

    The power is 1 if the shape has none. Another power is that of the load divided by a
    ``reference`` in N m (1 N m if the shape has none), so that ``mu`` is the lost share of a load
    of this size. With ``driving``, it acts only while the joint moves its load, and not while the
    load moves the joint; with ``backdriven``, it is this share of its size while the load moves the
    joint, as for the efficiency of many gears. With ``viscous``, it also grows with
    the speed, in units of 1 rad/s or 1 m/s, so that ``mu`` has no unit. If the torque of the drive
    counts, the load includes the ``friction`` (N m or N) and the ``damping`` that the drive has to
    overcome as well, and the ``inertia`` of the rotor (kg m^2 or kg) that it accelerates. The
    friction of a preloaded gear depends on the load above a ``threshold``, N m or N; that of a
    single rubbing flank depends on load of one sign (``side``, 1 or -1). With ``gravity``, only the
    weight of the described bodies counts, as for bearings that carry them.

    The gear transmits the torque that the bodies need at the joint; the torque that accelerates the
    rotor acts before the gear and is part of the load only with an ``inertia``. A fit that hardly
    tells rotor and link apart is another reason for one.
    """

    kind = "load_dependent_friction"
    drawn_against = "load"
    title = "Load-dependent friction"
    formula = r"\mu\,\tau_r\,|\tau_\mathrm{load}/\tau_r|^p\,\mathrm{sign}(\dot q)"
    coefficients = (Coefficient("mu", "1", sign=1),)
    shapes = (
        Shape("power", "1", (), 0.3, 3.0, scales=False),
        Shape("friction", "N m", (), 1e-9, np.inf, scales=False, has_interval=False),
        Shape("damping", "N m s/rad", (), 1e-9, np.inf, scales=False, has_interval=False),
        Shape("inertia", "kg m^2", (), 1e-9, np.inf, scales=False, has_interval=False),
        Shape("threshold", "N m", (), 1e-9, np.inf, scales=False, has_interval=False),
        Shape("backdriven", "1", (), 0.02, 1.0, scales=False),
    )
    forms = (
        {"power": 0.5},
        {"power": 2.0},
        {"driving": 1.0},
        {"backdriven": 0.4},
        {"viscous": 1.0},
        {"friction": 0.3, "damping": 0.1},
        {"driving": 1.0, "friction": 0.3, "damping": 0.1},
        {"inertia": 0.1},
        {"inertia": 3.0},  # of a wrist, whose rotor takes more torque than its link
        {"friction": 0.3, "damping": 0.1, "inertia": 0.1},
        {"threshold": 0.5},
        {"side": 1.0},
        {"side": -1.0},
        {"gravity": 1.0},
    )
    needs = ("load",)
    simplicity = 7
    rivals = ("coulomb", "position_dependent_friction", "torque_gain")
    separating_motion = "the same sweep with and without a known payload"
    reference = (
        "Hamon, Gautier, Garrec (2010), IROS, 6187-6193; "
        "Duclusaud et al. (2024), Extended friction models for servo actuators."
    )

    #: The plain form needs no search, although there are further forms.
    has_shape = False

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        assert signals.load is not None
        typical = float(np.sqrt(np.mean(signals.load[:, joints[0]] ** 2)))
        speed, rate = (
            max(float(np.sqrt(np.mean(signal[:, joints[0]] ** 2))), 1e-9)
            for signal in (signals.dq, signals.ddq)
        )
        reference = {"reference": typical} if typical > 0 else {}
        found: list[dict[str, Any]] = [{}]
        for form in map(dict, self.forms):
            if "friction" in form:
                form["friction"] *= typical
                form["damping"] *= typical / speed
            if "inertia" in form:
                form["inertia"] *= typical / rate
            if "threshold" in form:
                form["threshold"] *= typical
            found.append(form | (reference if "power" in form else {}))
        return found

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        if "friction" not in shape:
            return True
        # if the drive always pushes, this is a gain of the torque with viscous and dry friction
        speed = signals.dq[:, joints[0]]
        moves = np.abs(speed) > MOVES * np.abs(speed).max(initial=0.0)
        driven = _carried(signals, joints[0], shape) * speed < 0
        return bool(np.mean(driven[moves]) > DRIVEN) if moves.any() else False

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        reference, carried = shape.get("reference", 1.0), _carried(signals, joint, shape)
        beyond = np.maximum(0.0, np.abs(carried) - shape.get("threshold", 0.0))
        if "side" in shape:
            beyond = np.where(shape["side"] * carried > 0, beyond, 0.0)
        load = reference * (beyond / reference) ** shape.get("power", 1.0)
        friction: Array = load * (signals.dq if "viscous" in shape else signals.sign)[:, joint]
        if "driving" in shape or "backdriven" in shape:
            drives = carried * signals.dq[:, joint] > 0
            friction = friction * np.where(drives, 1.0, shape.get("backdriven", 0.0))
        return friction[:, None]

    def units(self, prismatic: bool = False) -> dict[str, str]:
        return super().units(prismatic) | {"reference": "N" if prismatic else "N m"}
