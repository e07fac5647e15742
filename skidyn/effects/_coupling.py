# SPDX-License-Identifier: BSD-3-Clause
"""Effects of a transmission that couples two joints: shared gears, cables, hoses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from skidyn._signals import SIGN_BLUR, Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient, Shape
from skidyn.effects._springs import stiffens

_RATIO = Shape(
    "ratio", "1", (1.0, -1.0), -np.inf, np.inf, spacing="linear", scales=False, has_interval=False
)
#: Largest ratio, in units of the two joints: beyond it an effect of the second joint alone fits,
#: and below its inverse one that the first joint does not feel. Between a slider and a joint that
#: turns, a screw for example, the unit itself is only a guess.
LARGEST_RATIO, GUESSED = 10.0, (0.1, 1.0, 10.0)
#: Further ratios of common gears, of which friction is tried: its sign depends on them.
GEARS = (0.5, 2.0)
_GAUTIER = "Janot, Vandanjon, Gautier (2014), IEEE TCST 22(1), 132-145 (TX40 wrist)."


class _PairEffect(Effect):
    """Acts through x = x_i + r x_j: the column on joint i and r times this column on joint j."""

    scope = "pair"
    shapes: ClassVar[tuple[Shape, ...]] = (_RATIO,)

    def coupled_columns(
        self, signals: Signals, i: int, j: int, ratio: float, **form: float
    ) -> Array:
        """Columns as functions of the coupled coordinate, shape (n_samples, n_coefficients)."""
        raise NotImplementedError

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        i, j = joints
        block = self.coupled_columns(signals, i, j, **shape)
        return {i: block, j: shape["ratio"] * block}

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        unit = self.travel(signals, joints, {})
        scales = GUESSED if _differ(signals, joints) else (1.0,)
        ratios = [{"ratio": sign * scale * unit} for scale in scales for sign in _RATIO.grid]
        return [ratio | form for form in self._plain_and_forms(signals, joints) for ratio in ratios]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        largest = LARGEST_RATIO * (GUESSED[-1] if _differ(signals, joints) else 1.0)
        ratio = abs(shape["ratio"]) / self.travel(signals, joints, shape)
        return bool(1 / largest <= ratio <= largest)

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        i, j = joints
        return float(signals.unit[i] / signals.unit[j])


def _differ(signals: Signals, joints: Sequence[int]) -> bool:
    """Whether one of two joints slides and the other one turns."""
    i, j = joints
    return bool(signals.prismatic[i] != signals.prismatic[j])


class CoupledFriction(_PairEffect):
    """Friction of a shaft that turns with the sum of two joint velocities.

    The viscous part may grow with another ``power`` of the speed (1 where the shape has none), in
    units of 1 rad/s or 1 m/s. The dry part may grow as the hyperbolic tangent of the speed divided
    by a ``rounding``, as Coulomb friction may. A ``differential`` has two such shafts, one that
    turns with the sum and one with the difference of the velocities, with equal or ``unequal``
    friction.
    """

    kind = "coupled_friction"
    drawn_against = "dq"
    title = "Coupled friction"
    formula = r"F_v\,\dot x + F_c\,\mathrm{sign}\,\dot x,\quad \dot x = \dot q_i + r\,\dot q_j"
    coefficients = (Coefficient("Fc", "N m", sign=1), Coefficient("Fv", "N m s/rad", sign=1))
    shapes = (
        _RATIO,
        Shape("power", "1", (), 0.3, 3.0, scales=False),
        Shape("rounding", "rad/s", (), 1e-3, 1.0, has_interval=False),
    )
    forms = (
        {"power": 2.0},
        {"power": 0.5},
        {"rounding": 0.2},
        {"differential": 1.0},
        {"differential": 1.0, "unequal": 1.0},
    )
    simplicity = 17
    rivals = ("viscous", "coulomb")
    separating_motion = "the two joints moved together, then against each other"
    reference = _GAUTIER

    def coupled_columns(
        self, signals: Signals, i: int, j: int, ratio: float, **form: float
    ) -> Array:
        speed = signals.dq[:, i] + ratio * signals.dq[:, j]
        drag = np.sign(speed) * np.abs(speed) ** form.get("power", 1.0)
        rounding = form.get("rounding", SIGN_BLUR * signals.unit[i])
        return np.column_stack([np.tanh(speed / rounding), drag])

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        unit = self.travel(signals, joints, {})
        plain = [{"ratio": sign * gear * unit} for gear in GEARS for sign in (1.0, -1.0)]
        apart = [{"ratio": gear * unit, "differential": 1.0} for gear in GEARS]
        # a differential is the same with either sign
        tried = super().grid(signals, joints)
        once = [s for s in tried if "differential" not in s or s["ratio"] > 0]
        return [*once, *plain, *apart]

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        columns = super().torque_columns(signals, joints, **shape)
        if "differential" in shape:
            other = super().torque_columns(signals, joints, **shape | {"ratio": -shape["ratio"]})
            apart = "unequal" in shape
            return {
                j: np.hstack([block, other[j]]) if apart else block + other[j]
                for j, block in columns.items()
            }
        return columns

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        if "unequal" not in shape:
            return self.coefficients
        second = (replace(c, name=f"{c.name}2") for c in self.coefficients)
        return (*self.coefficients, *second)


class CoupledInertia(_PairEffect):
    """Inertia of a shaft that turns with the sum of two joint velocities.

    If the model has the inertias of both joints already, only the torques ``across`` are missing:
    of each joint through the acceleration of the other, as by a motor that another link carries. Of
    the ratio only the sign matters then.

    Behind a crank or a lever, the shaft turns by another amount per turn of a joint at each
    position: with a ``lever`` in its shape, in 1/rad, times ``1 + lever (q - middle)`` of the first
    or the second joint (``of``).
    """

    kind = "coupled_inertia"
    drawn_against = "ddq"
    title = "Coupled inertia"
    formula = r"I_a\,(\ddot q_i + r\,\ddot q_j)"
    coefficients = (Coefficient("Ia", "kg m^2", sign=1),)
    shapes = (
        _RATIO,
        Shape("lever", "1/rad", (), -2.0, 2.0, spacing="linear", scales=False),
    )
    forms = ({"across": 1.0}, {"lever": 0.3, "of": 1.0}, {"lever": 0.3, "of": 2.0})
    simplicity = 18
    rivals = ("rotor_inertia",)
    separating_motion = "the two joints accelerated together, then against each other"
    reference = _GAUTIER

    def coupled_columns(
        self, signals: Signals, i: int, j: int, ratio: float, **form: float
    ) -> Array:
        return (signals.ddq[:, i] + ratio * signals.ddq[:, j])[:, None]

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        if "lever" in shape:
            return _levered(signals, joints, **shape)
        if "across" not in shape:
            return super().torque_columns(signals, joints, **shape)
        i, j = joints
        ratio = np.copysign(self.travel(signals, joints, shape), shape["ratio"])
        return {own: ratio * signals.ddq[:, [other]] for own, other in ((i, j), (j, i))}

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        shapes = super().grid(signals, joints)
        for shape in shapes:
            if "lever" in shape:
                q = signals.q[:, joints[int(shape["of"]) - 1]]
                shape["middle"] = float((q.min() + q.max()) / 2)
        return shapes


def _levered(
    signals: Signals,
    joints: Sequence[int],
    ratio: float,
    lever: float,
    of: float,
    middle: float,
    **form: float,
) -> dict[int, Array]:
    """Columns of an inertia that turns with a joint through a lever: d/dt of w and its slopes."""
    behind = joints[int(of) - 1]
    slope = 1 + lever * (signals.q[:, behind] - middle)
    slopes = {
        j: r * (slope if j == behind else 1.0) for j, r in zip(joints, (1.0, ratio), strict=True)
    }
    turn = sum(slopes[j] * signals.ddq[:, j] for j in joints)
    turn = turn + (ratio if of == 2 else 1.0) * lever * signals.dq[:, behind] ** 2
    return {j: (slopes[j] * turn)[:, None] for j in joints}


class CouplingSpring(_PairEffect):
    """Spring or hose between two joints.

    The shape of a nonlinear one contains the coupled coordinate ``x0`` at which it is slack, and
    a ``power`` of the distance from it, with coordinates in units of 1 rad or 1 m so that the unit
    of the stiffness is the same; or a distance from ``x0`` beyond which it stiffens as a hyperbolic
    sine (``stiffening``) or softens as a hyperbolic tangent (``softening``). A cable or hose that
    can only pull acts on one ``side`` of ``x0``; with ``slack``, it acts beyond this distance on
    both sides, with ``bent``, it has another stiffness beyond ``x0``, and with ``cubic``, the
    stiffness ``k`` at ``x0`` grows with the square of the distance from there.
    """

    kind = "coupling_spring"
    title = "Coupling spring"
    formula = r"k\,(q_i + r\,q_j - x_0)^p"
    coefficients = (
        Coefficient("k", "N m/rad", sign=1),
        Coefficient("dk", "N m/rad"),
        Coefficient("k3", "N m/rad^3", sign=1),  # what softens, as a cosine, has forms of its own
        Coefficient("tau0", "N m", is_zero=True),
    )
    shapes = (
        _RATIO,
        Shape("x0", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("power", "1", (), 1.2, 5.0, scales=False),
        Shape("stiffening", "rad", (), 0.05, 2.0),
        Shape("softening", "rad", (), 0.05, 2.0),
        Shape("slack", "rad", (), 0.01, 2.0),
    )
    forms = (
        {"x0": 0.0, "power": 3.0},
        {"x0": 0.0, "cubic": 1.0},
        {"x0": 0.0, "stiffening": 0.4},
        {"x0": 0.0, "softening": 0.4},
        {"x0": 0.0, "side": 1.0},
        {"x0": 0.0, "side": -1.0},
        {"x0": 0.0, "slack": 0.3},
        {"x0": 0.0, "bent": 1.0},
    )
    simplicity = 16
    rivals = ("spring",)
    separating_motion = "slow motion of the two joints together, then against each other"
    reference = "Tsai (1999), Robot Analysis, Wiley, chapter 7."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        shapes = super().grid(signals, joints)
        for shape in shapes:
            if "x0" in shape:
                x = self._stretch(signals, joints, {"ratio": shape["ratio"]})
                shape["x0"] = float(x.min() + x.max()) / 2
        # with a guessed ratio, the coordinate may be far larger than the unit of its joint
        return [shape for shape in shapes if self._finite(signals, joints, shape)]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        if not super().admissible(signals, joints, shape):
            return False
        if "x0" not in shape:
            return True
        x = self._stretch(signals, joints, shape)
        # the slack position, and motion beyond it on both sides, are within the log
        slack = shape.get("slack", 0.0)
        return bool(x.min() < -slack and slack < x.max()) and self._finite(signals, joints, shape)

    def _finite(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        x = self._stretch(signals, joints, shape)
        return stiffens(x, shape.get("stiffening", np.inf))

    @staticmethod
    def _stretch(signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> Array:
        """The coupled coordinate, from where the spring is slack."""
        i, j = joints
        stretch: Array = signals.q[:, i] + shape["ratio"] * signals.q[:, j] - shape.get("x0", 0.0)
        return stretch  # also symbols, for exports

    def coupled_columns(
        self, signals: Signals, i: int, j: int, ratio: float, **form: float
    ) -> Array:
        x = self._stretch(signals, (i, j), form | {"ratio": ratio})
        if "stiffening" in form:
            force = form["stiffening"] * np.sinh(x / form["stiffening"])
        elif "softening" in form:
            force = form["softening"] * np.tanh(x / form["softening"])
        elif "side" in form:
            force = form["side"] * np.maximum(form["side"] * x, 0.0)
        elif "slack" in form:
            force = np.maximum(x - form["slack"], 0.0) + np.minimum(x + form["slack"], 0.0)
        elif "bent" in form:
            return np.column_stack([x, np.maximum(x, 0.0), np.ones_like(x)])
        elif "cubic" in form:
            return np.column_stack([x, x**3, np.ones_like(x)])
        else:
            force = np.sign(x) * np.abs(x) ** form.get("power", 1.0)
        return np.column_stack([force, np.ones_like(x)])

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        k, change, cubic, zero = self.coefficients
        further = {"bent": (change,), "cubic": (cubic,)}
        return (k, *next((own for form, own in further.items() if form in shape), ()), zero)
