# SPDX-License-Identifier: BSD-3-Clause
"""The result of a diagnosis, and its methods for users."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from skidyn._exceptions import EffectError, SkidynError
from skidyn._joint_numbers import joint_numbers
from skidyn._signals import Array
from skidyn.diagnosis._comparison import REGIMES, Comparison, error_map
from skidyn.diagnosis._correction import CorrectedRegressor, Opened, is_physics
from skidyn.diagnosis._failures import Failure, RestError, find_failures, find_rest_errors
from skidyn.diagnosis._findings import Finding
from skidyn.diagnosis._hypothesis import SearchResult
from skidyn.diagnosis._limits import Limit
from skidyn.diagnosis._notebook import notebook
from skidyn.diagnosis._remainder import Remainder
from skidyn.diagnosis._servo_settings import as_stated, setting_of, with_settings
from skidyn.diagnosis._simulated import of_finding, report_of, simulated
from skidyn.diagnosis._story import story
from skidyn.diagnosis._unknown import UnknownTorque
from skidyn.effects import Term, get_effect, make_new_terms
from skidyn.evidence import Problem
from skidyn.identification import RBDRegressor
from skidyn.measurement import Suspicion
from skidyn.simulation import (
    HORIZON,
    LAWS,
    Controller,
    InTurn,
    ServoFinding,
    SimulationVerdict,
    explain_servo_motion,
    judge_in_turn,
    servo_torque,
)

#: Beginning of the sentence on a finding that the model for simulation does not contain.
_VETO = "Not in the completed model because it worsens the simulated motion:"

#: Findings that are usual for servos, in addition to which the motion may show another effect.
_PLAIN = ("offset", "rotor_inertia")

Verdict = Literal["complete", "missing", "unknown"]


@dataclass(repr=False)
class Diagnosis:
    """Result of a diagnosis: missing effects, errors, and the completed model.

    Made by :func:`skidyn.diagnosis.diagnose`.

    Parameters
    ----------
    verdict : {"complete", "missing", "unknown"}
        Nothing significant is missing; a known effect is missing; an effect is missing that no
        known effect explains.
    joint_names : tuple of str
        Names of the joints.
    findings : list of Finding
        Missing effects in the order they were added.
    comparison : Comparison
        Measured against predicted torque of the model as given, held out.
    comparison_after : Comparison
        The same with the findings added.
    history : list of dict
        ``{"added", "joints", "rmse"}`` of every step; errors per joint, held out, N m or N.
    noise_floor : ndarray of shape (n_joints,)
        Noise of torque and position sensors together in the error of samples, N m or N.
    unexplained : dict or None
        Joints, variables and share of the error that is predictable but not explained by known
        effects.
    limits : list of Limit
        Largest magnitude of every effect that was not found.
    warnings : list of str
        Warnings about the data or the folds.
    base_model : regressor
        The model as given.
    data : tuple
        X and the torque of the diagnosis.
    problem : Problem
        Averaged rows and folds behind the diagnosis.
    result : SearchResult
        Result of the search with its last fit.
    predictable : ndarray of shape (n_joints,)
        Share of the remaining squared error that a flexible learner predicts.
    unknowns : list of UnknownTorque
        Tested variables, shape and formula of every unknown torque that was found.
    checks : list of Suspicion
        Suspicions of the checks of the measurement, with evidence and remedy.
    parts : Remainder
        Remaining error of the completed model, by component.
    opened : Opened or None
        Pipeline or search from which the model was extracted, if any.
    vetoed : list of Finding
        Findings that worsen the simulated motion, which :attr:`model` leaves out; empty before
        :meth:`judge_by_simulation`.
    in_turn : InTurn or None
        Results of :meth:`judge_by_simulation` for every finding and for all together.
    servo_motion : list of ServoFinding or None
        Effects found by :meth:`explain_servo_motion`; None before it is called.
    controller : Controller or None
        Controller given to :func:`diagnose`, with the settings of servos that were found and that
        are not in :attr:`vetoed`.
    stated : Controller or None
        The controller as given, for a log without torque.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.diagnosis import diagnose
    >>> from skidyn.identification import RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=6, duration=5.0)
    >>> diagnose(RBDRegressor(log.robot), log.X, log.y).verdict
    'complete'
    """

    verdict: Verdict
    joint_names: tuple[str, ...]
    findings: list[Finding]
    comparison: Comparison
    comparison_after: Comparison
    history: list[dict[str, Any]]
    noise_floor: Array
    unexplained: dict[str, Any] | None
    limits: list[Limit]
    warnings: list[str]
    base_model: Any = field(repr=False)
    data: tuple[Any, ...] = field(repr=False)
    problem: Problem = field(repr=False)
    result: SearchResult = field(repr=False)
    predictable: Array = field(repr=False, default_factory=lambda: np.zeros(0))
    unknowns: list[UnknownTorque] = field(default_factory=list)
    checks: list[Suspicion] = field(default_factory=list)
    parts: Remainder | None = None
    opened: Opened | None = field(repr=False, default=None)
    vetoed: list[Finding] = field(repr=False, default_factory=list)
    in_turn: InTurn | None = field(repr=False, default=None)
    servo_motion: list[ServoFinding] | None = None
    controller: Controller | None = field(default=None, repr=False)
    stated: Controller | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        units = ["N" if slides else "N m" for slides in self.problem.signals.prismatic]
        errors = zip(self.joint_names, self.rmse_before, self.rmse_after, units, strict=True)
        lines = [f"Diagnosis: {self.verdict}", *(f.sentence for f in self.findings)]
        lines += [found.sentence for found in self.servo_motion or ()]
        lines += [f"error of {n}: {a:.4g} -> {b:.4g} {unit}" for n, a, b, unit in errors]
        return "\n  ".join([*lines, *(f"note: {note}" for note in self.warnings)])

    @property
    def rmse_before(self) -> Array:
        """Held-out error of the model as given on the samples judged, (n_joints,), N m or N."""
        return np.array(self.history[0]["rmse"])

    @property
    def rmse_after(self) -> Array:
        """Held-out error with all findings added on the samples judged, (n_joints,), N m or N."""
        return np.array(self.history[-1]["rmse"])

    @cached_property
    def failures(self) -> list[Failure]:
        """Joints whose error exceeds their noise, the largest ratio first, and where it does."""
        return find_failures(self.comparison, self.noise)

    @cached_property
    def rest_errors(self) -> list[RestError]:
        """Errors at rest, with what dry friction allows there."""
        return find_rest_errors(self.comparison)

    @property
    def noise(self) -> Array:
        """Noise with which errors are compared, (n_joints,), N m or N."""
        return self.noise_floor

    @property
    def sensor_noise(self) -> Array:
        """Noise of the torque sensors alone, (n_joints,), N m or N."""
        return self.noise_floor if self.parts is None else self.parts.sensor_noise

    @property
    def remainder(self) -> Array:
        """Error that is neither noise nor predictable from the signals, (n_joints,), N m or N."""
        return np.zeros(len(self.joint_names)) if self.parts is None else self.parts.left

    @property
    def remainder_inflation(self) -> Array:
        """Autocorrelation of the remainder: 1 if white, up to 2 for coloured noise; (n_joints,)."""
        return np.ones(len(self.joint_names)) if self.parts is None else self.parts.inflation

    @property
    def noise_is_coloured(self) -> bool:
        """Whether the error exceeds fast noise equally on all joints, as for correlated noise."""
        return self.parts is not None and self.parts.coloured

    @property
    def regimes(self) -> tuple[str, ...]:
        """Names of the columns of :meth:`error_map`."""
        return REGIMES

    def story(self) -> dict[str, Any]:
        """Content of the first screen of the report: verdict, joints, findings, remaining error.

        Returns
        -------
        dict
            ``verdict``, ``mark``, ``headline``, ``text``; ``findings`` in a line each (``what``,
            ``where``, ``size``, ``sure``, ``change``); ``joints`` with ``before``, ``after`` and
            ``noise`` (N m or N) and ``speaks`` for joints that are shown; ``quiet``, ``left``,
            ``doubts`` about the log and other ``warnings``; ``simulation`` with errors of the
            simulated motion, after :meth:`judge_by_simulation`; ``servo_motion`` with the effects
            found by :meth:`explain_servo_motion`.
        """
        return {**story(self), "simulation": simulated(self.in_turn, self.findings)}

    def _repr_html_(self) -> str:
        return notebook(self.story())

    def error_map(self, after: bool = False) -> Array:
        """Error by joint and regime.

        Parameters
        ----------
        after : bool, default=False
            With the findings added.

        Returns
        -------
        ndarray of shape (n_joints, n_regimes), N m or N
            NaN where a regime does not occur.
        """
        return error_map(self.comparison_after if after else self.comparison)

    @property
    def budget(self) -> list[dict[str, float]]:
        """Share of each joint's squared error by cause: findings, unexplained, noise."""
        table = []
        for j in range(len(self.joint_names)):
            first = max(self.history[0]["rmse"][j] ** 2, 1e-300)
            shares: dict[str, float] = {}
            for before, after in zip(self.history[:-1], self.history[1:], strict=True):
                drop = (before["rmse"][j] ** 2 - after["rmse"][j] ** 2) / first
                shares[after["added"]] = shares.get(after["added"], 0.0) + float(drop)
            last = self.history[-1]["rmse"][j] ** 2 / first
            floor = float(self.noise_floor[j] ** 2 / first)
            shares["unexplained"] = float(max(last - floor, 0.0))
            shares["noise"] = floor
            table.append(shares)
        return table

    @cached_property
    def model(self) -> Any:
        """The given model with every finding added that is not vetoed, fitted to all data."""
        kept = [f for f in self.findings if not any(f is other for other in self.vetoed)]
        terms = [t for f in kept for t in f.terms]
        if self.controller is None or not any(map(setting_of, self.vetoed)):
            return self._refitted(terms)
        X, _, *weight = self.data  # whose torque has the settings that are vetoed
        return self._refitted(terms, (X, servo_torque(self.controller, X), *weight))

    def judge_by_simulation(
        self, horizon: float | None = HORIZON, *, controller: Controller | None = None
    ) -> list[SimulationVerdict | None]:
        """Judge every finding by the simulated motion along recordings left out of the fit.

        The errors of the motion without and with the findings are stored in :attr:`simulation` and
        shown on the page and in the report. An effect that reduces the error of the torque may
        worsen the motion. An effect that worsens it significantly is added to :attr:`vetoed`, with
        a sentence in :attr:`warnings`, and is not part of :attr:`model`; :meth:`add` adds it
        nevertheless.

        A setting of a servo changes the torque of the servos: the model without it is fitted to the
        torque of the servo as stated, the other to that with the setting. With a controller, each
        is simulated in the loop of its own servo. A setting that is vetoed is no longer part of
        :attr:`controller`.

        Parameters
        ----------
        horizon : float, s, or None, default=1.0
            Time after which the simulation restarts from the logged state; None for whole
            recordings.
        controller : Controller, optional
            Drives the model by the commands of X (``q_ref1..`` or ``cmd1..``) instead of the
            torque, for logs of position servos.

        Returns
        -------
        list of SimulationVerdict or None
            For every finding; None if simulation gives no evidence.

        Raises
        ------
        SkidynError
            The model is not an RBDRegressor, it cannot be simulated, or the log has no time.

        See Also
        --------
        skidyn.simulation.judge_additions : How recordings are left out.
        """
        if not isinstance(self.base_model, RBDRegressor):
            raise SkidynError(
                f"the model is {type(self.base_model).__name__}; a simulation needs the inertia of "
                "an RBDRegressor"
            )
        additions = [setting_of(finding) or finding.terms for finding in self.findings]
        n, stated = len(self.joint_names), None
        if self.stated is not None and any(map(setting_of, self.findings)):
            given = self.stated if controller is None else controller
            stated = as_stated(given, self.stated, self.findings, n)
        self.in_turn = judge_in_turn(
            self.base_model,
            additions,
            *self.data[:2],
            controller=controller,
            horizon=horizon,
            servos=stated,
        )
        verdicts = self.in_turn.verdicts
        self.vetoed = [
            f for f, v in zip(self.findings, verdicts, strict=True) if v is not None and v.worsens
        ]
        self.warnings = [note for note in self.warnings if not note.startswith(_VETO)]
        for finding, verdict in zip(self.findings, verdicts, strict=True):
            if verdict is not None and verdict.worsens:
                where = ", ".join(self.joint_names[j - 1] for j in finding.joints)
                self.warnings.append(f"{_VETO} {finding.title} of {where}. {verdict.text}")
        if self.stated is not None:
            kept = [f for f in self.findings if not any(f is other for other in self.vetoed)]
            self.controller = with_settings(self.stated, kept, n)
        self.__dict__.pop("model", None)
        return verdicts

    def explain_servo_motion(self, controller: Controller | None = None) -> list[ServoFinding]:
        """Find effects by the motion of position servos that the torque does not show.

        A torque computed from the position error of a servo hides effects that last hundredths of a
        second. Joints are simulated in their loops (:func:`skidyn.simulation.explain_servo_motion`)
        with the findings that the simulation supports, and without unknown functions, hysteresis,
        offsets and saturation by the controller; joints with other findings are left out. The
        effects found replace unknown functions and hysteresis on their joints; :attr:`findings` are
        not changed. They are stored in :attr:`servo_motion` and shown in the report and on the
        page, and a diagnosis without any other finding is no longer ``"complete"``.

        Parameters
        ----------
        controller : Controller, optional
            Gains, delay and limit of the servos; X must hold the commands ``q_ref1..`` or
            ``cmd1..``. By default :attr:`controller`.

        Returns
        -------
        list of ServoFinding
            In the order of selection.

        Raises
        ------
        SkidynError
            The model is not an RBDRegressor, no controller is given, or the log has no commands.
        LogError
            The log is too short.
        """
        if not isinstance(self.base_model, RBDRegressor):
            raise SkidynError(
                f"the model is {type(self.base_model).__name__}; a simulation needs the inertia of "
                "an RBDRegressor"
            )
        controller = self.controller if controller is None else controller
        if controller is None:
            raise SkidynError(
                "controller is missing: give the gains of the servos as Controller(...)"
            )
        named: set[int] = set()
        known: list[tuple[str, int]] = []
        # A known limit of the controller is simulated and is not an effect.
        limited = np.isfinite(controller.checked(len(self.joint_names)).limit)
        for finding in self.findings:
            effect = None if finding.kind == "unknown" else get_effect(finding.kind)
            if effect is None or finding.kind in _PLAIN or effect.family == "hysteresis":
                continue
            if effect.of_servo:  # part of the controller
                continue
            if finding.kind == "saturation" and all(limited[j - 1] for j in finding.joints):
                continue
            if finding.kind in LAWS:
                known += [(finding.kind, j) for j in finding.joints]
            else:
                named |= set(finding.joints)
        joints = [j for j in range(1, len(self.joint_names) + 1) if j not in named]
        found: list[ServoFinding] = []
        if joints:
            # Bodies fitted without the known effects would be biased by them.
            terms = [t for f in self.findings if f.kind in (*LAWS, *_PLAIN) for t in f.terms]
            model = self.base_model.with_effects(terms).fit(*self.data)
            found = explain_servo_motion(
                model, self.data[0], controller, joints=joints, known=known
            )
        self.servo_motion = found
        if not self.findings and self.verdict != "unknown":
            self.verdict = "missing" if self.servo_motion else "complete"
        return self.servo_motion

    @property
    def simulation(self) -> SimulationVerdict | None:
        """Simulated motion of the model as given, and with the findings; None before it is judged.

        The second model excludes findings that worsen the motion or that cannot be simulated.
        """
        return None if self.in_turn is None else self.in_turn.together

    def add(self, kind: str, joints: int | Sequence[int] | None = None) -> Any:
        """Add an effect to the model and fit it again.

        Parameters
        ----------
        kind : str
            Kind of the catalogue; ``"unknown"`` for the unknown function that was found, or
            ``"formula"`` for the formula proposed for it. A setting of the servo that was found is
            added to the controller: the model is fitted to the torque of the servo with it.
        joints : int or sequence of int, optional
            Joints, counted from 1; by default those of the finding of this kind, or all joints.

        Returns
        -------
        RBDRegressor
            Fitted to all data.

        Raises
        ------
        EffectError
            Unknown kind, a joint that the robot lacks, an effect that the model has already or
            whose signals the log lacks, no formula was proposed, or no such setting of a servo was
            found.
        SkidynError
            ``joints`` is not a number, or several.
        """
        joints = None if joints is None else joint_numbers(joints)
        if kind == "formula":
            return self._refitted(self._formulas(joints))
        if kind != "unknown" and get_effect(kind).of_servo:
            return self._with_setting(kind, joints)
        wanted = None if joints is None else set(joints)
        found = [t for f in self.findings if f.kind == kind for t in f.terms]
        terms = [t for t in found if wanted is None or len(t.joints) > 1 or set(t.joints) <= wanted]
        if terms and (wanted is None or wanted <= {j for t in terms for j in t.joints}):
            return self._refitted(dict.fromkeys(terms))
        spec: Any = kind if joints is None else (kind, joints)
        had = getattr(self.base_model, "effects", ())
        return self._refitted(make_new_terms(spec, had, len(self.joint_names)))

    def _with_setting(self, kind: str, joints: Sequence[int] | None) -> Any:
        """The model fitted to the torque of servos with a setting that was found."""
        wanted = None if joints is None else set(joints)
        known = {j for f in self.findings if f.kind == kind for j in f.joints}
        moved = [f for f in self.servo_motion or () if f.kind == kind]
        found = known | {f.joint for f in moved}
        if not found or not (wanted is None or wanted <= found):
            raise EffectError(
                f"{kind} was not found on these joints; it is a setting of the servo, to be stated "
                "in Controller(...)"
            )
        controller, X = self.controller, self.data[0]
        used = [f for f in moved if wanted is None or f.joint in wanted]
        if not used or controller is None:
            return self._refitted(())  # the torque of the diagnosis has it
        for f in used:
            controller = controller.with_joint(len(self.joint_names), f.joint, **f.parameters)
        return self.base_model.with_effects(()).fit(X, servo_torque(controller, X))

    def _formulas(self, joints: Sequence[int] | None) -> list[Term]:
        """Terms of the proposed formulas."""
        proposals = [
            u.proposal
            for u in self.unknowns
            if u.proposal is not None and (joints is None or u.joint in set(joints))
        ]
        if not proposals:
            raise EffectError(
                "no formula was proposed for these joints; diagnosis.unknowns lists the torques "
                "that were found"
            )
        return [t for proposal in proposals for t in proposal.terms]

    def _refitted(self, terms: Iterable[Term], data: tuple[Any, ...] | None = None) -> Any:
        model, data = self.base_model, self.data if data is None else data
        if is_physics(model):
            better = model.with_effects(terms).fit(*data)
        else:
            if not isinstance(model, CorrectedRegressor):
                assert self.problem.robot is not None
                model = CorrectedRegressor(model, self.problem.robot)
            elif hasattr(model, "regressor_"):
                model = CorrectedRegressor(model.regressor_, model.robot, model.effects)
            better = model.with_effects(terms).fit_effects(*data)
        return better if self.opened is None else self.opened.closed(better)

    def to_dict(self) -> dict[str, Any]:
        """As the report file of ``skidyn diagnose``.

        Returns
        -------
        dict
            Following the schema ``skidyn.diagnosis/1``; provenance is added by the report.
        """
        return {
            "schema": "skidyn.diagnosis/1",
            "verdict": self.verdict,
            "joints": list(self.joint_names),
            "rmse_before": [float(x) for x in self.rmse_before],
            "rmse_after": [float(x) for x in self.rmse_after],
            "noise_floor": [float(x) for x in self.noise_floor],
            "sensor_noise": [float(x) for x in self.sensor_noise],
            "remainder": [float(x) for x in self.remainder],
            "remainder_inflation": [float(x) for x in self.remainder_inflation],
            "noise_is_coloured": self.noise_is_coloured,
            "effects": [
                *(
                    {**finding.to_dict(), **of_finding(self.in_turn, k)}
                    for k, finding in enumerate(self.findings)
                ),
                *(found.to_effect() for found in self.servo_motion or ()),
            ],
            "unexplained": self.unexplained,
            "limits": [limit.to_dict() for limit in self.limits],
            "history": self.history,
            "warnings": list(self.warnings),
            "checks": [check.to_dict() for check in self.checks],
            "simulation": report_of(self.in_turn),
            "servo_motion": None
            if self.servo_motion is None
            else [found.to_dict() for found in self.servo_motion],
        }
