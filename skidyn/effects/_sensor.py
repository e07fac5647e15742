# SPDX-License-Identifier: BSD-3-Clause
"""Faults of the logged torque itself: its gain, its delay, its limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._derivatives import smooth_derivatives
from skidyn.effects._parameters import Coefficient, Shape


class TorqueGain(Effect):
    """The logged torque is too large or too small by a factor.

    With a ``sign`` in its shape this holds only for positive (1) or negative torque (-1), as for a
    fault in one half of a bridge or of an amplifier. With ``over_speed`` the factor changes with
    the speed of the joint, as where the voltage for the current is no longer sufficient; with
    ``over_torque`` it changes with the torque, as that of a motor whose iron saturates. With
    ``near_zero``, in N m, small torques have another factor, as from a converter or amplifier that
    is not linear where the current changes its sign: it fades exponentially over this torque.
    """

    kind = "torque_gain"
    drawn_against = "load"
    title = "Torque gain"
    formula = r"\varepsilon\,\tau_\mathrm{model}"
    coefficients = (Coefficient("epsilon", "1"),)
    #: Change of the factor per speed, and per torque.
    per_speed = Coefficient("epsilon_speed", "s/rad")
    per_torque = Coefficient("epsilon_torque", "1/(N m)")
    #: What is added to the factor at the smallest torques.
    at_zero = Coefficient("epsilon_zero", "1")
    #: The plain form needs none.
    has_shape = False
    shapes = (Shape("near_zero", "N m", (), 1e-9, np.inf, scales=False, has_interval=False),)
    forms = (
        {"sign": 1.0},
        {"sign": -1.0},
        {"over_speed": 1.0},
        {"over_torque": 1.0},
        {"near_zero": 0.2},  # of the largest torque
    )
    needs = ("model_torque",)
    by_recording = True
    drifts = True
    simplicity = 5
    rivals = ("payload", "load_dependent_friction")
    separating_motion = "a known payload carried through the same motion"
    reference = "Gautier, Briot (2014), ASME JDSMC 136(5): drive gains from a known payload."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        *others, near_zero = map(dict, self.forms)
        torque = signals.model_torque
        most = 0.0 if torque is None else float(np.quantile(np.abs(torque[:, joints[0]]), 0.999))
        small = {name: share * most for name, share in near_zero.items()}
        return [{}, *others, *([small] if most > 0 else [])]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.model_torque is not None
        torque = signals.model_torque[:, [joint]]
        if "near_zero" in shape:
            return np.hstack([torque, torque * np.exp(-np.abs(torque) / shape["near_zero"])])
        if "over_speed" in shape:
            return np.hstack([torque, torque * np.abs(signals.dq[:, [joint]])])
        if "over_torque" in shape:
            return np.hstack([torque, torque * np.abs(torque)])
        sign = shape.get("sign")
        return torque if sign is None else sign * np.maximum(0.0, sign * torque)

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        changes = {
            "over_speed": (self.per_speed,),
            "over_torque": (self.per_torque,),
            "near_zero": (self.at_zero,),
        }
        further = next((own for form, own in changes.items() if form in shape), ())
        return (*self.coefficients, *further)

    def units(self, prismatic: bool = False) -> dict[str, str]:
        speed, torque = ("s/m", "1/N") if prismatic else ("s/rad", "1/(N m)")
        further = {"epsilon_speed": speed, "epsilon_torque": torque, "epsilon_zero": "1"}
        return super().units(prismatic) | further


#: Share of a sampling step within which the values of a row may have been taken.
SAME_ROW = 0.5
#: Longest shift of a torque, s.
LONGEST_SHIFT = 0.3


class TimeDelay(Effect):
    """The torque channel lags behind the motion channels.

    The plain formula is of first order in the delay, and holds for any lag that is short. With a
    ``shift`` in its shape, in s, it is the difference from the torque at this earlier time, so that
    a ``delay`` of the same size is a pure delay.
    """

    kind = "time_delay"
    drawn_against = "ddq"
    title = "Time delay of the torque"
    formula = (
        r"-d\,\dot\tau_\mathrm{model}\ \text{or}\ "
        r"\tfrac{d}{s}\,(\tau_\mathrm{model}(t - s) - \tau_\mathrm{model}(t))"
    )
    # Beyond it the first-order expansion of a delay is no longer valid.
    coefficients = (Coefficient("delay", "s", limit=0.1),)
    shapes = (Shape("shift", "s", (), 0.01, LONGEST_SHIFT, scales=False),)
    forms = ({"shift": 0.04},)
    needs = ("model_torque", "time")
    sizes_by_recording = True
    is_slow = True
    simplicity = 6
    rivals = ("joint_elasticity", "rotor_inertia", "viscous")
    separating_motion = "fast motion with sharp changes of torque"
    reference = "Ljung (1999), System Identification, chapter 14."

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        if "shift" in shape:
            return (Coefficient("delay", "s", limit=LONGEST_SHIFT),)
        return self.coefficients

    def sites(self, signals: Signals) -> list[tuple[int, ...]]:
        # A bus delays all joints equally; a single slow sensor delays its own joint.
        together = [tuple(range(signals.n_joints))] if signals.n_joints > 1 else []
        return together + super().sites(signals)

    def too_small(
        self, intervals: Mapping[str, tuple[float, float, float]], signals: Signals
    ) -> str | None:
        step = float(np.median(signals.steps))
        delay, low, high = intervals["delay"]
        if low > SAME_ROW * step or high < -SAME_ROW * step:
            return None
        return (
            f"a delay of {1e3 * delay:.2g} ms cannot be told from half of the sampling step of "
            f"{1e3 * step:.3g} ms or less, and loggers differ by as much in when they read the "
            "channels of a row"
        )

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        assert signals.model_torque is not None
        if "shift" in shape:
            shift, torque = float(shape["shift"]), signals.model_torque
            return {
                j: (_earlier(torque[:, [j]], signals, shift) - torque[:, [j]]) / shift
                for j in joints
            }
        # Dry friction jumps at a reversal: its derivative is a spike that affects only the rows of
        # reversals. The lag is visible in the smooth part.
        smooth = (
            signals.smooth_torque if signals.smooth_torque is not None else signals.model_torque
        )
        # The acceleration is noisy, and its derivative would be noise on single samples.
        return {j: -smooth_derivatives(smooth[:, [j]], signals, order=2)[1] for j in joints}


def _earlier(x: Array, signals: Signals, shift: float) -> Array:
    """Signals, (n_samples, 1), a time earlier; at first those of the start of the segment."""
    assert signals.time is not None
    y = np.empty_like(x)
    for rows in signals.segments:
        time = signals.time[rows]
        y[rows, 0] = np.interp(time - shift, time, x[rows, 0])
    return y


#: Least share of the torque beyond the limit that a saturation removes; less is a gain that changes
#: with the torque.
LEAST_CUT = 0.3
#: Largest share of it that a limit cuts off, with the error of its estimate: of what is beyond, no
#: more than all is missing.
MOST_CUT = 1.25
#: Quantiles of the torque that are tried as its limit: rare peaks are far above it.
CUT_OFF = (0.98, 0.92)


class Saturation(Effect):
    """The logged or delivered torque is cut off at a limit.

    With ``rounding`` in its shape the torque approaches the limit smoothly, as a hyperbolic tangent
    if ``rounding`` is 1. With a ``side`` only positive (1) or negative torque (-1) is cut off; with
    ``limit_below`` negative torque is cut off at another size, as in a hydraulic cylinder. The
    ``share`` of the torque beyond the limit that is cut off is at least 0.3.
    """

    kind = "saturation"
    drawn_against = "load"
    title = "Torque saturation"
    formula = r"-c\,\mathrm{sign}(\tau)\max(0,\,|\tau| - L)"
    coefficients = (Coefficient("share", "1", sign=1, limit=MOST_CUT, is_share=True),)
    shapes = (
        Shape("limit", "N m", (0.97, 0.93, 0.88, 0.8, 0.7, 0.6), 1e-9, np.inf, scales=False),
        Shape("limit_below", "N m", (), 1e-9, np.inf, scales=False),
    )
    #: A rounded limit has an effect far below it.
    forms = ({"rounding": 1.0}, {"side": 1.0}, {"side": -1.0}, {"limit_below": 1.0})
    needs = ("model_torque",)
    simplicity = 15
    rivals = ("torque_gain",)
    separating_motion = "motion at lower torque, below the limit"
    reference = "Swevers, Verdonck, De Schutter (2007), IEEE Control Systems 27(5), 58-71."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        assert signals.model_torque is not None
        torque = signals.model_torque[:, joints[0]]
        highest = float(np.quantile(np.abs(torque), 0.999))
        if not highest > 0:
            return []
        rounded, *sides, _ = map(dict, self.forms)
        shares = self.shapes[0].grid

        def limits(torque: Array, shares: Sequence[float]) -> list[float]:
            most, *peaks = np.quantile(torque, (0.999, *CUT_OFF)).tolist()
            return [x for x in (*(share * most for share in shares), *peaks) if x > 0]

        shapes = [{"limit": limit} for limit in limits(np.abs(torque), shares)]
        shapes += [{"limit": highest / share} | rounded for share in (0.6, 0.9)]
        ends = [limits(form["side"] * torque, shares[1::2]) for form in sides]
        for form, own in zip(sides, ends, strict=True):
            shapes += [{"limit": limit} | form for limit in own]
        pairs = zip(*ends, strict=False) if len(ends[0]) == len(ends[1]) else ()
        return shapes + [{"limit": a, "limit_below": b} for a, b in pairs]

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        assert signals.model_torque is not None
        torque = signals.model_torque[:, joint]
        if "rounding" in shape:
            limit = shape["limit"]
            return np.asarray(limit * np.tanh(torque / limit) - torque)[:, None]
        if "side" in shape:
            side = shape["side"]
            return np.asarray(-side * np.maximum(0.0, side * torque - shape["limit"]))[:, None]
        above = np.maximum(0.0, torque - shape["limit"])
        below = np.maximum(0.0, -torque - shape.get("limit_below", shape["limit"]))
        return np.asarray(below - above)[:, None]

    def least(self, shape: Mapping[str, Any]) -> float:
        return LEAST_CUT

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        limits = {name: shape[name] for name in ("limit", "limit_below") if name in shape}
        return limits | {"share": float(coefficients[0])}
