# SPDX-License-Identifier: BSD-3-Clause
"""Unknown torques caused by another joint, or by an oscillating mass on the link."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._nameless import NamelessEffect, unnamed_coefficients
from skidyn.effects._parameters import Shape
from skidyn.effects._second_order import second_order_filter


def _with_size(shapes: list[dict[str, Any]], torque: Array | None) -> list[dict[str, Any]]:
    """Shapes with the root mean square of the other joint's torque, N m or N; none without it."""
    if torque is None:
        return []
    size = np.sqrt(np.mean(torque**2, axis=0))
    return [shape | {"size": float(size[shape["other"]])} for shape in shapes]


class FrictionOverOtherLoad(NamelessEffect):
    """Friction of one joint that grows with the load of another."""

    kind = "friction_over_other_load"
    drawn_against = "dq"
    title = "Friction that follows another joint's load"
    formula = r"f(|\tau_k|)\,\mathrm{sign}\,\dot q_j"
    coefficients = unnamed_coefficients(2)
    needs = ("load",)

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return (f"dq{joint + 1}", f"tau{int(shape['other']) + 1}")

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return _with_size(self.others(signals, joints[0]), signals.load)

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.load is not None
        load = np.abs(signals.load[:, int(shape["other"])]) / max(shape["size"], 1e-300)
        sign = signals.sign[:, joint]
        return np.column_stack([load * sign, load**2 * sign])


class Crosstalk(NamelessEffect):
    """A share of another joint's torque, as by crosstalk of a sensor's bridge or cable."""

    kind = "crosstalk"
    drawn_against = "load"
    title = "Share of another joint's torque"
    formula = r"c\,\tau_k"
    coefficients = unnamed_coefficients(1)
    needs = ("model_torque",)
    is_of_one_number = True

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return (f"tau{int(shape['other']) + 1}",)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return [] if signals.model_torque is None else self.others(signals, joints[0])

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.model_torque is not None
        return signals.model_torque[:, [int(shape["other"])]]


class FunctionOfOtherTorque(Crosstalk):
    """A torque that depends on that of another joint: a bent gauge, a supply that both share."""

    kind = "function_of_other_torque"
    title = "Function of another joint's torque"
    formula = r"f(\tau_k)"
    coefficients = unnamed_coefficients(3)

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return _with_size(super().grid(signals, joints), signals.model_torque)

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        torque = super().columns(signals, joint, **shape)[:, 0] / max(shape["size"], 1e-300)
        return np.column_stack([torque, np.abs(torque), torque * np.abs(torque)])


class GyroscopicCouple(NamelessEffect):
    """A torque of one joint due to the speed of another, and its reaction, by a spinning mass [1]_.

    It uses no energy: the power on one joint is the opposite of that on the other.

    References
    ----------
    .. [1] W. Thomson, P. G. Tait (1883), Treatise on natural philosophy, part I, section 345
       (gyrostatic domination).
    """

    kind = "gyroscopic_couple"
    drawn_against = "dq"
    title = "Gyroscopic couple"
    formula = r"\tau_i = h\,\dot q_j,\quad \tau_j = -h\,\dot q_i"
    coefficients = unnamed_coefficients(1)
    scope = "pair"
    is_of_one_number = True

    def variables(self, joint: int, shape: dict[str, Any]) -> tuple[str, ...]:
        return (f"dq{joint + 1}", f"dq{int(shape['other']) + 1}")

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return [{"other": joints[1]}]

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        i, j = joints
        return {i: signals.dq[:, [j]], j: -signals.dq[:, [i]]}


class SwingingLoad(NamelessEffect):
    """An oscillating mass on the link: liquid in a tank, a hose, a loose battery [1]_.

    References
    ----------
    .. [1] R. A. Ibrahim (2005), Liquid sloshing dynamics, Cambridge University Press, chapter 5
       (equivalent mechanical models).
    """

    kind = "swinging_load"
    drawn_against = "ddq"
    title = "Oscillating load on the link"
    formula = r"c_1\,\omega^2 z + c_2\,\omega\dot z,"
    formula += r"\quad \ddot z + 2\zeta\omega\dot z + \omega^2 z = -\ddot q_j"
    coefficients = unnamed_coefficients(2)
    shapes = (
        Shape("frequency", "Hz", (0.6, 0.9, 1.35, 2.0, 3.0, 4.5), 0.1, 50.0, scales=False),
        Shape("damping", "1", (0.03, 0.15), 0.001, 1.0, scales=False),
    )
    depends_on = ("q_own", "ddq_own")
    needs = ("time",)
    is_of_one_number = True

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        from scipy.signal import lfilter  # slow to import, and not needed to check a log

        omega, damping = 2 * np.pi * shape["frequency"], shape["damping"]
        columns = np.zeros((signals.n_samples, 2))
        for rows, step in zip(signals.segments, signals.steps, strict=True):
            if rows.stop - rows.start < 7 or omega * step > 1:
                continue  # it oscillates faster than the log can show
            for k, top in enumerate(((0.0, 0.0, -(omega**2)), (0.0, -omega, 0.0))):
                b, a = second_order_filter(top, omega, damping, 1 / step)
                columns[rows, k] = lfilter(b, a, signals.ddq[rows, joint])
        return columns


COUPLED: tuple[type[NamelessEffect], ...] = (
    FrictionOverOtherLoad,
    Crosstalk,
    FunctionOfOtherTorque,
    GyroscopicCouple,
    SwingingLoad,
)
