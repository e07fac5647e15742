# SPDX-License-Identifier: BSD-3-Clause
"""Base class of effects: small, declarative, linear in the coefficients."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from skidyn._exceptions import EffectError
from skidyn._signals import Array, Signals
from skidyn.effects._parameters import Coefficient, Shape

#: Where an effect acts: on each joint by itself, on a pair of joints, or on the whole robot.
Scope = Literal["joint", "pair", "robot"]


class Effect:
    r"""Base class of physical effects.

    Subclasses declare the effect in class attributes and define its columns. To add an effect,
    write such a class in a file of ``skidyn/effects`` and list it in the catalogue (or call
    :func:`skidyn.effects.register_effect` from your own code).

    Attributes
    ----------
    kind : str
        Name in the catalogue.
    title : str
        Title of the effect.
    formula : str
        Torque in LaTeX.
    coefficients : tuple of Coefficient
        Linear coefficients, one per column.
    shapes : tuple of Shape
        Parameters that enter nonlinearly.
    forms : tuple of dict
        Other forms of the formula that are tested in addition to the plain one, as further entries
        of the shape: ``{"power": 2.0}``. For an entry that is also one of :attr:`shapes` it is the
        initial value of the search; others are fixed.
    scope : {"joint", "pair", "robot"}
        Where it acts.
    search : {"grid", "spectrum", "trajectories", "clock", "screened", "given", "servo"}
        Method to find its shape: on a grid, as a line in the spectrum over joint angle or over
        time, as a split of the trajectories into those with and without the effect, from the
        signals on which the residual depends, none because it is always given, or none because it
        is a setting of a servo, which has no columns.
    nameless : bool
        Whether it represents an effect that is not in the catalogue (``unknown``).
    amplitudes : tuple of str
        Parameters that are the length of two coefficients each, as the amplitude of a wave; its
        other parameters that are no shapes are their angles.
    drawn_against : {"q", "dq", "ddq", "load", "temperature", "time"}
        Signal against which it is plotted in reports.
    family : str
        Family of effects that are often separated only by special motion (``"hysteresis"``).
    needs : tuple of str
        Optional signals it needs: ``"temperature"``, ``"time"``, ``"load"``, ``"model_torque"``,
        ``"motor_torque"`` (that of the model before the sensor, which includes the effect itself),
        ``"robot"``, ``"command"``.
    automatic : bool
        Whether the diagnosis and the explorer try it unless other kinds are asked for. False for
        refinements of an effect that would take its place on many logs.
    leading : int
        With ``search="trajectories"``: number of first coefficients that every single trajectory
        determines; all of them if 0.
    is_body : bool
        With ``search="trajectories"``: whether the identified bodies take it in if it is there in
        all trajectories.
    places : tuple of str
        With ``search="trajectories"``: entries of the shape for other places than the usual one
        (:meth:`elsewhere`).
    elsewhere_must_gain : float
        Multiple of what the effect at its usual place removes that it must remove elsewhere.
    grows : bool
        With ``search="trajectories"``: whether the trajectories with the larger first coefficient
        have the effect, even if they are the majority, as a payload adds mass.
    softness : float
        Ridge penalty relative to the square of its largest column; for flexible functions, which
        the data may leave undetermined somewhere.
    by_recording : bool
        Whether it may differ between recordings, and is also tested for some of them only.
    drifts : bool
        Whether its size may change steadily over the log or over each recording, as for a load that
        empties or a base that sinks, and is also tested in this form.
    sizes_by_recording : bool
        Whether all joints may have it in another size in each recording, as a base that is moved or
        a logger that is started by hand in between, and it is also tested in this form.
    is_exact : bool
        Whether the formula is exact for this effect, so that any residual is another effect; other
        formulas are approximations and leave a residual.
    moves_link : bool
        Whether it moves the link away from the position that the encoder logged. It may last only
        hundredths of a second, so that it is also searched in short averages.
    follows_acceleration : bool
        Whether it resembles the noise of accelerations in short averages, so that it is not
        searched there if positions are coarse.
    without_swing : frozenset of str
        Entries of the shape of a form that moves the link without an oscillation, which noise of
        accelerations resembles in short averages.
    is_slow : bool
        Whether the formula is valid for slow changes only, so that no fast effect is reported
        together with it, and its other forms are tried whatever it leaves.
    simplicity : int
        Rank among rivals that explain the data equally well; the lowest is preferred.
    rivals : tuple of str
        Kinds with which it is easily confused.
    separating_motion : str
        Motion that separates it from its rivals.
    caveat : str
        Note that is part of every finding of this kind.
    reference : str
        Paper or book.

    Examples
    --------
    >>> class AirDrag(Effect):
    ...     kind = "air_drag"
    ...     title = "Air drag"
    ...     formula = r"c\,\dot q\,|\dot q|"
    ...     coefficients = (Coefficient("c", "N m s^2/rad^2", sign=1),)
    ...     def columns(self, signals, joint):
    ...         dq = signals.dq[:, joint]
    ...         return (dq * abs(dq))[:, None]
    >>> AirDrag().describe()["kind"]
    'air_drag'
    """

    kind: ClassVar[str] = ""
    title: ClassVar[str] = ""
    formula: ClassVar[str] = ""
    coefficients: ClassVar[tuple[Coefficient, ...]] = ()
    shapes: ClassVar[tuple[Shape, ...]] = ()
    forms: ClassVar[tuple[Mapping[str, float], ...]] = ()
    scope: ClassVar[Scope] = "joint"
    search: ClassVar[
        Literal["grid", "spectrum", "trajectories", "clock", "screened", "given", "servo"]
    ] = "grid"
    nameless: ClassVar[bool] = False
    amplitudes: ClassVar[tuple[str, ...]] = ()
    drawn_against: ClassVar[str] = "q"
    family: ClassVar[str] = ""
    needs: ClassVar[tuple[str, ...]] = ()
    automatic: ClassVar[bool] = True
    leading: ClassVar[int] = 0
    is_body: ClassVar[bool] = False
    places: ClassVar[tuple[str, ...]] = ()
    elsewhere_must_gain: ClassVar[float] = 1.0
    grows: ClassVar[bool] = False
    by_recording: ClassVar[bool] = False
    drifts: ClassVar[bool] = False
    sizes_by_recording: ClassVar[bool] = False
    softness: ClassVar[float] = 0.0
    is_exact: ClassVar[bool] = False
    moves_link: ClassVar[bool] = False
    follows_acceleration: ClassVar[bool] = False
    without_swing: ClassVar[frozenset[str]] = frozenset()
    is_slow: ClassVar[bool] = False
    simplicity: ClassVar[int] = 50
    rivals: ClassVar[tuple[str, ...]] = ()
    separating_motion: ClassVar[str] = ""
    caveat: ClassVar[str] = ""
    reference: ClassVar[str] = ""

    @property
    def has_shape(self) -> bool:
        """Whether the columns depend on a shape that has to be given or estimated.

        Entries that only further forms have are not required: the plain form does not need them.
        """
        plain = any(shape.name not in self.form_names for shape in self.shapes)
        return plain or type(self).grid is not Effect.grid

    @property
    def comes_and_goes(self) -> bool:
        """Whether it may act in some recordings only, unlike inertia and elasticity of the arm.

        Of effects of the whole robot, those that may also change over the log, as a base that
        sinks; a load has a search of its own.
        """
        passing = self.drawn_against in ("q", "dq", "load") and not self.moves_link
        return passing and self.search == "grid" and (self.scope != "robot" or self.drifts)

    @property
    def form_names(self) -> frozenset[str]:
        """Names of shape entries that only further forms of the formula have."""
        return frozenset(name for form in self.forms for name in form) | frozenset(self.places)

    @property
    def needs_fit(self) -> bool:
        """Whether the columns require a fitted model."""
        return not {"load", "model_torque"}.isdisjoint(self.needs)

    @property
    def follows_fit(self) -> bool:
        """Whether the columns depend on the fit: on its torque, or its rigid body."""
        return self.needs_fit or "robot" in self.needs

    @property
    def of_servo(self) -> bool:
        """Whether it is a setting of the controller, and not a torque of the model."""
        return self.search == "servo"

    @property
    def sees_model(self) -> bool:
        """Whether it acts on the torque of the whole model, as a sensor does."""
        return "model_torque" in self.needs

    @property
    def sees_motor(self) -> bool:
        """Whether it depends on the torque of the motor, of which it is a part itself."""
        return "motor_torque" in self.needs

    @property
    def on_bodies(self) -> bool:
        """Whether it acts on the bodies of the robot, so that the gears carry its torque."""
        return self.scope == "robot" and not self.needs_fit

    def elsewhere(self, signals: Signals) -> list[dict[str, Any]]:
        """Shapes of other places at which the effect may act in some of the trajectories.

        Parameters
        ----------
        signals : Signals
            Motion.

        Returns
        -------
        list of dict
            Shape parameters, one dictionary for each place; none by default.
        """
        return []

    def simplicity_of(self, shape: Mapping[str, Any]) -> int:
        """Rank among rivals that explain the data equally well, for a given shape.

        Parameters
        ----------
        shape : mapping
            Shape parameters.

        Returns
        -------
        int
            :attr:`simplicity` by default; the lowest is preferred.
        """
        return self.simplicity

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        """Linear coefficients for a given shape, one per column.

        Parameters
        ----------
        shape : mapping
            Shape parameters.

        Returns
        -------
        tuple of Coefficient
            :attr:`coefficients` by default. A further form may have more of them.
        """
        return self.coefficients

    def can_have(self, coefficients: Array, shape: Mapping[str, Any], signals: Signals) -> bool:
        """Whether coefficients are those of this effect, and not of another one.

        Parameters
        ----------
        coefficients : ndarray of shape (n_coefficients,)
            Fitted values.
        shape : mapping
            Shape parameters.
        signals : Signals
            Motion and robot.

        Returns
        -------
        bool
            True by default.
        """
        return True

    def positive(
        self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]
    ) -> Array | None:
        """Weights of the coefficients in a sum that must not be clearly negative.

        Parameters
        ----------
        signals : Signals
            Motion.
        joints : sequence of int
            Places of the term's joints in arrays.
        shape : mapping
            Shape parameters.

        Returns
        -------
        ndarray of shape (n_coefficients,) or None
            None by default.
        """
        return None

    def usually(
        self,
        coefficients: Array,
        shape: Mapping[str, Any],
        signals: Signals,
        joints: Sequence[int],
    ) -> str | None:
        """Kind that an effect with such coefficients usually is, if that is nearly as good.

        Parameters
        ----------
        coefficients : ndarray of shape (n_coefficients,)
            Fitted values.
        shape : mapping
            Shape parameters.
        signals : Signals
            Motion and robot.
        joints : sequence of int
            Its joints, from 0.

        Returns
        -------
        str or None
            None, its own kind, by default.
        """
        return None

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        """Columns of the effect on its own joint.

        Parameters
        ----------
        signals : Signals
            Motion.
        joint : int
            Place of the joint in arrays.
        **shape : float
            Values of the shape parameters.

        Returns
        -------
        ndarray of shape (n_samples, n_coefficients)
            One column for each coefficient.
        """
        raise NotImplementedError

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        """Columns in the torque row of every joint on which the effect acts.

        Parameters
        ----------
        signals : Signals
            Motion.
        joints : sequence of int
            Places of the term's joints in arrays.
        **shape : float
            Values of the shape parameters.

        Returns
        -------
        dict of int to ndarray of shape (n_samples, n_coefficients)
            By the joint's place in arrays.
        """
        (joint,) = joints
        return {joint: self.columns(signals, joint, **shape)}

    def too_small(
        self, intervals: Mapping[str, tuple[float, float, float]], signals: Signals
    ) -> str | None:
        """Reason why an effect of this size is not significant for the robot; None if it is.

        Parameters
        ----------
        intervals : mapping of str to (float, float, float)
            Identified physical parameters, with the ends of their intervals.
        signals : Signals
            Logged motion.

        Returns
        -------
        str or None
            A reason in words.
        """
        return None

    def meaning(self, parameters: Mapping[str, Mapping[str, Any]]) -> str:
        """What the identified parameters mean for the robot, as a sentence; empty by default.

        Parameters
        ----------
        parameters : mapping of str to mapping
            ``value`` and ``unit`` of each physical parameter.

        Returns
        -------
        str
            The sentence.
        """
        return ""

    def not_shown(self, signals: Signals, joint: int) -> str | None:
        """Reason why this data cannot show the effect on a joint; None if it can.

        Parameters
        ----------
        signals : Signals
            Motion.
        joint : int
            Place of the joint in arrays.

        Returns
        -------
        str or None
            A reason in words.
        """
        if "temperature" in self.needs and signals.temperature is None:
            return "no temperature is logged"
        if "time" in self.needs and signals.time is None:
            return "no time is logged"
        if np.ptp(signals.q[:, joint]) < 1e-6 * signals.unit[joint]:
            return f"joint {joint + 1} does not move"
        return None

    def sites(self, signals: Signals) -> list[tuple[int, ...]]:
        """Joints or groups of joints on which the effect could act.

        Parameters
        ----------
        signals : Signals
            Motion.

        Returns
        -------
        list of tuple of int
            Places of the joints in arrays.
        """
        n = signals.n_joints
        if self.scope == "robot":
            return [tuple(range(n))]
        if self.scope == "pair":
            return list(itertools.combinations(range(n), 2))
        return [(j,) for j in range(n)]

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        """Initial shape parameters of the search.

        Parameters
        ----------
        signals : Signals
            Motion.
        joints : sequence of int
            Places of the term's joints in arrays.

        Returns
        -------
        list of dict
            Combinations of shape parameters.
        """
        axes = []
        plain = [shape for shape in self.shapes if shape.name not in self.form_names]
        for shape in plain:
            unit = signals.unit[joints[0]] if shape.scales else 1.0
            axes.append([value * unit for value in shape.grid])
        names = [shape.name for shape in plain]
        shapes = [dict(zip(names, values, strict=True)) for values in itertools.product(*axes)]
        return [shape | form for form in self._plain_and_forms(signals, joints) for shape in shapes]

    def _plain_and_forms(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        """What the plain formula and each further form add to a shape, in units of the joint."""
        scaled = {shape.name for shape in self.shapes if shape.scales}
        unit = float(signals.unit[joints[0]])
        return [
            {name: x * unit if name in scaled else x for name, x in form.items()}
            for form in ({}, *self.forms)
        ]

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        """Whether this data can distinguish the effect with this shape from a simpler one.

        Parameters
        ----------
        signals : Signals
            Motion.
        joints : sequence of int
            Places of the term's joints in arrays.
        shape : mapping
            Shape parameters.

        Returns
        -------
        bool
            True by default. A contact is admissible only if some samples are in contact and others
            are not.
        """
        return True

    def bounded(
        self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any], share: float
    ) -> dict[str, Any]:
        """Shape parameters with those that bound the coefficients, see :meth:`least`.

        Parameters
        ----------
        signals : Signals
            Motion.
        joints : sequence of int
            Places of the term's joints in arrays.
        shape : mapping
            Shape parameters of the grid.
        share : float
            Least size of a coefficient, as a share of the size implied by the shape.

        Returns
        -------
        dict
            The same by default.
        """
        return dict(shape)

    def least(self, shape: Mapping[str, Any]) -> float:
        """Smallest value of a non-negative coefficient that is consistent with its shape.

        Parameters
        ----------
        shape : mapping
            Shape parameters.

        Returns
        -------
        float
            0 by default. For example, a known resonance bounds the stiffness of a spring.
        """
        return 0.0

    def fastest(self, shape: Mapping[str, Any]) -> float:
        """Frequency, Hz, up to which the motion must be known to detect it in short averages.

        Parameters
        ----------
        shape : mapping
            Shape parameters.

        Returns
        -------
        float
            0 by default. An oscillating load is visible at its resonance.
        """
        return 0.0

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        """Range of a shape parameter with linear spacing, in its own unit.

        Parameters
        ----------
        signals : Signals
            Motion.
        joints : sequence of int
            Places of the term's joints in arrays.
        shape : mapping
            Shape parameters.

        Returns
        -------
        float
            The positions of the first joint by default.
        """
        return float(np.ptp(signals.q[:, joints[0]]))

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        """Physical parameters from fitted coefficients and shape parameters.

        Parameters
        ----------
        coefficients : ndarray of shape (n_coefficients,)
            Fitted values.
        shape : mapping
            Shape parameters.
        signals : Signals, optional
            Motion the term was fitted on.

        Returns
        -------
        dict of str to float
            Physical parameters by name.
        """
        values: dict[str, Any] = {
            c.name: float(v) for c, v in zip(self.coefficients_of(shape), coefficients, strict=True)
        }
        return values | dict(shape)

    def units(self, prismatic: bool = False) -> dict[str, str]:
        """Unit of every coefficient and shape parameter.

        Parameters
        ----------
        prismatic : bool, default=False
            Whether the joint slides.

        Returns
        -------
        dict of str to str
            By name of the parameter.
        """
        units = {c.name: c.unit for c in self.coefficients}
        units |= {s.name: s.unit for s in self.shapes}
        if not prismatic:
            return units
        for turning, sliding in (("kg m^2", "kg"), ("N m", "N"), ("rad", "m")):
            units = {name: unit.replace(turning, sliding) for name, unit in units.items()}
        return units

    def formula_of(self, shape: Mapping[str, Any]) -> str:
        """The formula that a shape selects, in LaTeX.

        Parameters
        ----------
        shape : mapping
            Shape parameters.

        Returns
        -------
        str
            :attr:`formula` by default, which has all forms.
        """
        return self.formula

    def describe(self) -> dict[str, Any]:
        """All information printed in the catalogue, the report and the documentation.

        Returns
        -------
        dict
            Attributes of the class by name.
        """
        return {
            "kind": self.kind,
            "title": self.title,
            "formula": self.formula,
            "coefficients": [(c.name, c.unit, c.sign) for c in self.coefficients],
            "shapes": [(s.name, s.unit, s.low, s.high) for s in self.shapes],
            "scope": self.scope,
            "needs": list(self.needs),
            "rivals": list(self.rivals),
            "separating_motion": self.separating_motion,
            "reference": self.reference,
        }

    def check(self) -> None:
        """Raise an error for an incomplete declaration.

        Raises
        ------
        EffectError
            A class attribute is missing.
        """
        for name in ("kind", "title", "formula", "coefficients"):
            if not getattr(self, name):
                raise EffectError(f"effect class {type(self).__name__} lacks `{name}`")
