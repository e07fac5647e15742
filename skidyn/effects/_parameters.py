# SPDX-License-Identifier: BSD-3-Clause
"""What an effect declares of its parameters: linear coefficients, and those of its shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from skidyn._signals import Signals


@dataclass(frozen=True)
class Coefficient:
    """A linear coefficient of an effect.

    Parameters
    ----------
    name : str
        Symbol, such as ``"Fc"``.
    unit : str
        Unit for a revolute joint; for a slider ``N m`` becomes ``N`` and ``rad`` becomes ``m``.
    sign : {0, 1}
        1 if negative values are physically impossible.
    limit : float
        Largest magnitude at which the formula still describes the effect.
    is_share : bool
        Whether it is a share of a shape parameter, so that its own size has no meaning.
    is_divisor : bool
        Whether other parameters are divided by it, as centers of mass by a mass. If it may be zero,
        they have no meaning, and :meth:`Effect.parameters` is given a zero for it.
    is_zero : bool
        Whether it only defines the zero of the effect, as the constant of a spring: a finding must
        be significant without it.
    limit_kind : str
        Simpler kind that is equivalent to the effect if no other coefficient is significant, as
        friction that differs by a constant between the directions is an offset.

    Examples
    --------
    >>> Coefficient("Fc", "N m", sign=1).name
    'Fc'
    """

    name: str
    unit: str
    sign: int = 0
    limit: float = np.inf
    is_share: bool = False
    is_divisor: bool = False
    is_zero: bool = False
    limit_kind: str = ""


@dataclass(frozen=True)
class Shape:
    """A parameter that enters an effect nonlinearly and is searched on a grid, then refined.

    Parameters
    ----------
    name : str
        Symbol, such as ``"stribeck_velocity"``.
    unit : str
        Unit for a revolute joint.
    grid : tuple of float
        Initial values for a revolute joint; lengths are a tenth of it in m for sliders when
        ``scales`` is True.
    low, high : float
        Range of the refined value for a revolute joint.
    spacing : {"log", "linear", "samples"}
        Spacing of the refinement: by factors, by differences, or by samples of the log for a
        moment in time.
    scales : bool
        Whether the value is an angle or angular velocity, so that it scales for sliders.
    has_interval : bool
        Whether a confidence interval of the value is stated.
    limit_kind : str
        Simpler kind that is equivalent to the effect if the value is too small to be resolved, as
        pre-sliding friction becomes Coulomb friction.

    Examples
    --------
    >>> Shape("vs", "rad/s", (0.05, 0.1), 0.01, 1.0).spacing
    'log'
    """

    name: str
    unit: str
    grid: tuple[float, ...]
    low: float
    high: float
    spacing: Literal["log", "linear", "samples"] = "log"
    scales: bool = True
    has_interval: bool = True
    limit_kind: str = ""

    def range_on(self, signals: Signals, joint: int) -> tuple[float, float]:
        """Lowest and highest value on a joint; the latter grows with the travel of a slider.

        Parameters
        ----------
        signals : Signals
            Motion.
        joint : int
            Joint, from 0.

        Returns
        -------
        low, high : float
            In the unit of the value for this joint.
        """
        if not self.scales:
            return self.low, self.high
        unit = float(signals.unit[joint])
        far = float(np.ptp(signals.q[:, joint])) / 2 if signals.prismatic[joint] else unit
        return self.low * unit, self.high * max(unit, far)
