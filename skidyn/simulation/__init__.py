# SPDX-License-Identifier: BSD-3-Clause
"""Forward simulation of fitted models, in open or closed loop, and errors of their motion."""

from skidyn.forward import Controller, fit_controller
from skidyn.simulation._additions import judge_additions
from skidyn.simulation._bam_servo import fit_bam_servo, simulate_bam_servo
from skidyn.simulation._closed_loop import simulate_closed_loop
from skidyn.simulation._score import (
    SimulationErrors,
    SimulationVerdict,
    judge_by_simulation,
    neg_simulation_error,
    simulation_errors,
)
from skidyn.simulation._servo import fit_servo, servo_torque
from skidyn.simulation._servo_motion import ServoFinding, explain_servo_motion
from skidyn.simulation._simulate import simulate

__all__ = [
    "Controller",
    "ServoFinding",
    "SimulationErrors",
    "SimulationVerdict",
    "explain_servo_motion",
    "fit_bam_servo",
    "fit_controller",
    "fit_servo",
    "judge_additions",
    "judge_by_simulation",
    "neg_simulation_error",
    "servo_torque",
    "simulate",
    "simulate_bam_servo",
    "simulate_closed_loop",
    "simulation_errors",
]

# For other packages of skidyn; no part of the public interface.
from skidyn.simulation._additions import (
    InTurn as InTurn,
    Setting as Setting,
    judge_in_turn as judge_in_turn,
)
from skidyn.simulation._score import HORIZON as HORIZON
from skidyn.simulation._servo_laws import LAWS as LAWS
