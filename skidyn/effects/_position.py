# SPDX-License-Identifier: BSD-3-Clause
"""Effects that are periodic in the joint's own position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient, Shape


class PositionDependentFriction(Effect):
    """Friction whose level changes along the joint's travel.

    Dry friction varies as a wave or as a wave with its second harmonic (``overtone``), viscous
    friction as a wave (``viscous``); or both are higher or lower at one ``place`` of some ``width``
    by a dry part ``dFc`` and a viscous part ``dFv``.
    """

    kind = "position_dependent_friction"
    title = "Position-dependent friction"
    formula = (
        r"A\cos(n q - \varphi)\,\mathrm{sign}(\dot q)\ \text{or}\ "
        r"(\Delta F_c\,\mathrm{sign}(\dot q) + \Delta F_v\,\dot q)\,e^{-(q - q_s)^2/2 w^2}"
    )
    coefficients = (Coefficient("a", "N m"), Coefficient("b", "N m"))
    shapes = (
        Shape("n", "1/rad", (1.0, 2.0), 1.0, 100.0, spacing="linear", scales=False),
        Shape("place", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("width", "rad", (), 1e-3, 10.0),
    )
    #: Places that are tried, and widths, as shares of the travel.
    spots = tuple({"place": k / 8, "width": w} for w in (0.06, 0.15) for k in range(1, 8))
    forms = ({"overtone": 1.0}, {"viscous": 1.0}, *spots)
    amplitudes = ("A", "Av", "A2")
    simplicity = 22
    rivals = ("load_dependent_friction", "coulomb")
    separating_motion = "slow sweeps over the whole travel in both directions"
    reference = "Armstrong (1988), ICRA, 1422-1427."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        waves = (15.0, 30.0, 60.0) if signals.prismatic[joints[0]] else (1.0, 2.0)
        q = signals.q[:, joints[0]]
        low, span = float(q.min()), float(np.ptp(q))
        spots = [
            {"place": low + span * form["place"], "width": span * form["width"]}
            for form in self.spots
        ]
        # one wave and two over the travel: friction that varies irregularly
        own = (2 * np.pi / span, 4 * np.pi / span) if span > 0 else ()
        rich = [{"n": n, "overtone": 1.0} for n in (*waves, *own)]
        thick = [{"n": n, "viscous": 1.0} for n in waves]
        return [*({"n": n} for n in waves), *rich, *thick, *spots]

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        if "viscous" in shape:
            return (Coefficient("a", "N m s/rad"), Coefficient("b", "N m s/rad"))
        if "overtone" not in shape:
            return self.coefficients
        return (*self.coefficients, Coefficient("a2", "N m"), Coefficient("b2", "N m"))

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        travel = super().travel(signals, joints, shape)
        # one more wave over the travel
        return travel if "place" in shape else 2 * np.pi / max(travel, 1e-9)

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        q, sign = signals.q[:, joint], signals.sign[:, joint]
        if "place" in shape:
            near = np.exp(-0.5 * ((q - shape["place"]) / shape["width"]) ** 2)
            return np.column_stack([near * sign, near * signals.dq[:, joint]])
        if "viscous" in shape:
            sign = signals.dq[:, joint]
        phases = [shape["n"] * q] + [2 * shape["n"] * q] * ("overtone" in shape)
        return np.column_stack([wave(p) * sign for p in phases for wave in (np.cos, np.sin)])

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        a, b, *more = map(float, coefficients)
        if "place" in shape:
            return {"dFc": a, "dFv": b, **shape}
        size = "Av" if "viscous" in shape else "A"
        told = {size: float(np.hypot(a, b)), "phase": float(np.arctan2(b, a)), **shape}
        if more:
            c, d = more
            told |= {"A2": float(np.hypot(c, d)), "phase2": float(np.arctan2(d, c))}
        return told

    def units(self, prismatic: bool = False) -> dict[str, str]:
        torque, length = ("N", "m") if prismatic else ("N m", "rad")
        spot = {"dFc": torque, "dFv": f"{torque} s/{length}", "place": length, "width": length}
        wave = {"A": torque, "phase": "rad", "n": f"1/{length}", "A2": torque, "phase2": "rad"}
        return wave | spot | {"Av": spot["dFv"]}


class TorqueRipple(Effect):
    """Torque periodic in the position: cogging, gear teeth, a harmonic drive, a ball screw.

    With ``harmonics`` in its shape, the number of them, its waves have another form than a sine, as
    those of teeth with edges, pins or cams. With a ``second`` number of waves per rad there are two
    waves, as of two stages of a gear.
    """

    kind = "torque_ripple"
    title = "Torque ripple"
    formula = r"A\sin(N q - \varphi)"
    coefficients = (Coefficient("a", "N m"), Coefficient("b", "N m"))
    shapes = (
        Shape("N", "1/rad", (), 8.0, 420.0, spacing="linear", scales=False),
        Shape("second", "1/rad", (), 8.0, 420.0, spacing="linear", scales=False),
    )
    forms = ({"harmonics": 5.0}, {"second": 8.0})
    # Averaging over windows of time would remove a fast ripple, so it is searched in the residual
    # at the full rate, as a line in its spectrum over joint angle.
    search = "spectrum"
    amplitudes = ("A", "A2", "A3", "A4", "A5")
    simplicity = 20
    rivals = ("position_dependent_friction",)
    separating_motion = "slow constant-speed sweeps, so that the ripple stays below the sample rate"
    reference = "Gandhi, Thorp (2005), IEEE TCST 13(4); Tuttle, Seering (1996), IEEE TRA 12(3)."

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        orders = shape["N"] * np.arange(1, int(shape.get("harmonics", 1)) + 1)
        orders = [*orders, shape["second"]] if "second" in shape else orders
        phases = [order * signals.q[:, joint] for order in orders]
        return np.column_stack([wave(phase) for phase in phases for wave in (np.sin, np.cos)])

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        orders = range(2, int(shape.get("harmonics", 2 if "second" in shape else 1)) + 1)
        further = [Coefficient(f"{name}{k}", "N m") for k in orders for name in "ab"]
        return (*self.coefficients, *further)

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        first, *further = np.reshape(coefficients, (-1, 2))
        phase = float(np.arctan2(-first[1], first[0]))
        sizes = {f"A{k}": float(np.hypot(*both)) for k, both in enumerate(further, 2)}
        told = {"A": float(np.hypot(*first)), "phase": phase, **sizes, "N": shape["N"]}
        return told | {name: x for name, x in shape.items() if name not in told}

    def meaning(self, parameters: Mapping[str, Mapping[str, Any]]) -> str:
        waves, unit = (parameters["N"][name] for name in ("value", "unit"))
        if unit == "1/m":
            return f"It repeats every {2e3 * np.pi / waves:.4g} mm, as a screw does with its lead."
        return (
            f"It repeats {waves:.4g} times per turn of the joint: once per turn of the motor if "
            f"the gear ratio is {waves:.4g}, or twice, as in a strain wave gear, if it is "
            f"{waves / 2:.4g}."
        )

    def units(self, prismatic: bool = False) -> dict[str, str]:
        torque, length = ("N", "m") if prismatic else ("N m", "rad")
        sizes = dict.fromkeys(("A", "A2", "A3", "A4", "A5"), torque)
        return sizes | {"phase": "rad", "N": f"1/{length}", "second": f"1/{length}"}
