# SPDX-License-Identifier: BSD-3-Clause
"""Predictions of a fitted RBDRegressor: torque, its bands and its parts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sklearn.utils.validation import check_is_fitted

from skidyn._signals import Array, Signals
from skidyn.effects import MotorLoadFriction, Term
from skidyn.identification._reading import Reading
from skidyn.identification._uncertainty import PredictionBands, find_bands


class Prediction(Reading):
    """Torque from the coefficients of a fitted model."""

    bands_: PredictionBands
    inertial_parameters_: Array
    effect_coefficients_: dict[Term, Array]

    def predict(self, X: Any, return_std: bool = False) -> Any:
        """Torque of the model.

        Effects of single recordings (an offset of one run, a payload in some) act only in those
        recordings, which are recognised by their motion.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion. Effects with memory run along each trajectory.
        return_std : bool, default=False
            Also return the standard deviation of a measured torque from the prediction: errors of
            left-out folds, and the effect of the spread of the coefficients on this motion.

        Returns
        -------
        torque : ndarray of shape (n_samples, n_joints) or (n_samples,), N m or N
            Predicted torque.
        std : ndarray of the same shape, N m or N
            Only with ``return_std=True``.
        """
        signals, back = self._motion(X)
        torque = self._shaped_like_y(self._torque(signals)[back])
        if not return_std:
            return torque
        return torque, self._shaped_like_y(find_bands(self).std(self, signals)[back])

    def predict_interval(self, X: Any, level: float = 0.95) -> tuple[Array, Array]:
        """Band around the prediction that contains a share of the measured torques.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion.
        level : float, default=0.95
            Share of the samples, for motion and rest separately, in the band.

        Returns
        -------
        low, high : ndarray of shape (n_samples, n_joints) or (n_samples,), N m or N
            Borders of the band.

        Raises
        ------
        SkidynError
            The model was not fitted by ``fit``, so that no errors of left-out folds are known.
        ValueError
            ``level`` is not between 0 and 1.
        """
        signals, back = self._motion(X)
        half = find_bands(self).half_width(self, signals, level)[back]
        torque = self._torque(signals)[back]
        return self._shaped_like_y(torque - half), self._shaped_like_y(torque + half)

    def _shaped_like_y(self, torque: Array) -> Array:
        return torque[:, 0] if self._one_output else torque

    def _torque(self, signals: Signals) -> Array:
        """Torque of all joints; exporters call it with symbols in place of numbers."""
        torque = self.rigid_body_torque(signals.q, signals.dq, signals.ddq)
        for _ in self._effects(signals, torque):
            pass
        return torque

    def _effects(self, signals: Signals, torque: Array) -> Iterator[tuple[Term, dict[int, Array]]]:
        """Columns of every effect, each computed with the torque of the effects before it.

        Effects of the motor's torque follow those that need no fit, and solve for it.

        Effects on the transmission use the torque of the bodies: the rigid body's, given as
        ``torque``, and that of loads and contacts, which come first. Effects of the sensor come
        last and use the model's. The torque of each is added to ``torque``.
        """

        def rank(term: Term) -> tuple[bool, bool, bool]:
            effect = term.effect
            return not effect.on_bodies, effect.needs_fit, not effect.sees_motor

        order = sorted(self.effect_terms_, key=rank)
        on_sensor = any(term.effect.sees_model for term in order)
        smooth = torque.copy()
        signals = signals.with_(load=torque.copy(), inertial_parameters=self.inertial_parameters_)
        for term in order:
            state = signals
            if term.effect.sees_model:
                state = signals.with_(model_torque=torque.copy(), smooth_torque=smooth.copy())
            effect = term.effect
            if isinstance(effect, MotorLoadFriction):
                state = signals.with_(model_torque=torque.copy())
                own, (j,) = self.effect_coefficients_[term], term.places
                motor = torque.copy()
                motor[:, j] = effect.motor_torque(state, j, own, term.shape)
                state = state.with_(model_torque=motor)
            blocks = term.torque_columns(state)
            for j, block in blocks.items():
                own = block @ self.effect_coefficients_[term]
                torque[:, j] += own
                if on_sensor and not term.is_dry:
                    smooth[:, j] += own
            if term.effect.on_bodies:
                signals = signals.with_(load=torque.copy())
            yield term, blocks

    def rigid_body_torque(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Torque of the identified rigid body alone.

        Parameters
        ----------
        q, dq, ddq : ndarray of shape (n_samples, n_joints)
            Position, velocity and acceleration, SI units.

        Returns
        -------
        ndarray of shape (n_samples, n_joints), N m or N
            Torque without the effects.
        """
        check_is_fitted(self)
        return self.robot_.inverse_dynamics(q, dq, ddq, parameters=self.inertial_parameters_)
