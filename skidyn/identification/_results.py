# SPDX-License-Identifier: BSD-3-Clause
"""Tables and tests of the coefficients of a fitted RBDRegressor."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import lsq_linear
from sklearn.utils import estimator_html_repr
from sklearn.utils.validation import check_is_fitted

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.effects import Term, TermSum
from skidyn.evidence import Evidence
from skidyn.identification._consistency import make_consistent
from skidyn.identification._constraints import BodyConstraints
from skidyn.identification._identifiability import essential_parameters, open_combinations
from skidyn.identification._notebook import model_table
from skidyn.identification._regression import Solution
from skidyn.robots import Robot, find_base_parameters

#: Noise of a joint, relative to the noisiest, below which it counts as this.
LEAST_NOISE = 1e-7


class Results:
    """Results from the coefficients and the evidence of a fitted model."""

    robot_: Robot
    evidence_: Evidence
    effect_terms_: list[Term]
    coef_: Array
    coef_std_: Array
    coef_names_: list[str]
    noise_std_: Array
    hausman_: dict[str, Array]
    consistent: bool | BodyConstraints
    parameters: str
    estimator: str

    def _html_repr(self) -> str:
        """Scikit-learn's diagram for a notebook, followed by the numbers of a fitted model."""
        drawn = str(estimator_html_repr(self))
        if not hasattr(self, "coef_std_"):
            return drawn
        stated = {row["name"]: (row["value"], row["std"]) for row in self.parameter_table()}
        return drawn + model_table(self.robot_, self.effect_terms_, stated, self.noise_std_)

    def _repr_html_inner(self) -> str:
        return self._html_repr()

    def _repr_mimebundle_(self, **kwargs: Any) -> dict[str, str]:
        # scikit-learn 1.6 does not use `_html_repr`
        bundle: dict[str, str] = super()._repr_mimebundle_(**kwargs)  # type: ignore[misc]
        return bundle | {"text/html": self._html_repr()} if "text/html" in bundle else bundle

    def parameter_table(self) -> list[dict[str, Any]]:
        """Every coefficient with its standard error.

        Returns
        -------
        list of dict
            ``name``, ``value``, ``std`` and ``relative_std`` (std over value).
        """
        check_is_fitted(self)
        rows = zip(self.coef_names_, self.coef_, self.coef_std_, strict=True)
        return [
            {
                "name": name,
                "value": float(value),
                "std": float(std),
                "relative_std": float(std / abs(value)) if value else float("inf"),
            }
            for name, value, std in rows
        ]

    def open_combinations(self) -> list[dict[str, Any]]:
        """Combinations of coefficients that the data does not determine.

        Singular vectors of the weighted columns, scaled to equal length, that belong to a condition
        index of 100 or more, and the coefficients most of whose variance each of them causes. A
        rigid-body parameter stands for the base parameter that begins with it.

        Returns
        -------
        list of dict
            ``combination`` (dict of name to factor: the undetermined direction),
            ``condition_index`` (infinite without any information) and ``sentence``.

        References
        ----------
        D. A. Belsley, E. Kuh, R. E. Welsch (1980), Regression Diagnostics, chapter 3.
        """
        check_is_fitted(self)
        return open_combinations(self._weighted_rows()[:, :-1], self.evidence_.columns)

    def essential_parameters(self, ratio: float = 20.0, growth: float = 0.02) -> dict[str, Any]:
        """The coefficients that the data determines well, the others dropped in turn.

        As long as the largest relative standard error is more than ``ratio`` times the smallest,
        its coefficient is set to zero and the others are estimated again, unless the error grows
        too much. Standard errors here treat rows as independent; those of ``coef_std_`` do not.

        Parameters
        ----------
        ratio : float, default=20.0
            Largest permitted ratio of relative standard errors; 10 to 30 is usual.
        growth : float, default=0.02
            Share by which the root mean square residual may grow in total.

        Returns
        -------
        dict
            ``parameters`` (list of dict with ``name``, ``value``, ``std``, ``relative_std``),
            ``eliminated`` (list of str, in the order of elimination) and ``error_ratio`` (root mean
            square residual of the rows without them, relative to that with all).

        References
        ----------
        C. M. Pham, M. Gautier (1991), Essential parameters of robots, IEEE CDC, 2769-2774.
        """
        check_is_fitted(self)
        if not ratio >= 1:
            raise ValueError(f"ratio={ratio!r}; expected 1 or more")
        rows = self._weighted_rows()
        names = list(self.evidence_.columns)
        if self.parameters == "identified":
            # Standard errors relative to the parameters; the evidence is of corrections to the
            # URDF.
            base = find_base_parameters(self.robot_)
            n = len(base.index)
            rows[:, -1] += rows[:, :n] @ base.values(self.robot_.inertial_parameters)
            names[:n] = base.expressions
        count = float(sum(self.evidence_.counts.values()))
        return essential_parameters(rows, names, count, ratio, growth)

    def _weighted_rows(self) -> Array:
        """Triangular factor of [columns | torque], joints weighted by their noise."""
        rows = self.evidence_.stacked(dict(enumerate(self.noise_std_)))
        return np.asarray(np.linalg.qr(rows, mode="r"))

    def durbin_wu_hausman(self) -> list[dict[str, Any]]:
        """Test whether noise in the motion would bias least squares.

        Compares the instrumental-variable estimate with least squares, coefficient by coefficient
        (Durbin-Wu-Hausman). A small ``p_value`` means that least squares is biased; with many
        coefficients, compare it with the level divided by their number.

        Returns
        -------
        list of dict
            ``name``, ``difference`` (instrumental variables minus least squares), ``std`` and
            ``p_value``.

        Raises
        ------
        SkidynError
            The model was not fitted with ``estimator="instrumental"``.
        """
        check_is_fitted(self)
        if self.estimator != "instrumental":
            raise SkidynError("the test requires a fit with estimator='instrumental'")
        columns = (self.hausman_[key] for key in ("difference", "std", "p_value"))
        return [
            {"name": n, "difference": float(d), "std": float(s), "p_value": float(p)}
            for n, d, s, p in zip(self.coef_names_, *columns, strict=True)
        ]

    def _consistent(
        self, parameters: Array, effects: Array, solution: Solution
    ) -> tuple[Array, Array]:
        """Possible bodies and coefficients of the right sign with the least change of the fit."""
        known = self.consistent if isinstance(self.consistent, BodyConstraints) else None
        # A joint without noise would leave the others without weight.
        largest = float(solution.noise.max())
        noise = np.maximum(solution.noise / largest, LEAST_NOISE)
        rows = self.evidence_.stacked(dict(enumerate(noise)))[:, :-1]
        signs = TermSum(self.effect_terms_).signs
        if self.parameters == "nominal":
            low = np.where(signs > 0, 0.0, -np.inf)
            return parameters, lsq_linear(rows, rows @ effects, (low, np.inf)).x
        regrouping = find_base_parameters(self.robot_).regrouping
        factor = rows @ block_diag(regrouping, np.eye(len(effects)))
        if solution.prior is not None:
            factor = np.vstack([factor, largest * solution.prior])
        factor = np.asarray(np.linalg.qr(factor, mode="r"))
        target = factor @ np.r_[parameters.ravel(), effects]
        return make_consistent(
            self.robot_.inertial_parameters,
            factor,
            target,
            signs,
            effects,
            known=known,
            body_names=self.robot_.body_names,
        )
