# SPDX-License-Identifier: BSD-3-Clause
"""Simulation of a fitted model in a control loop."""

from skidyn.simulation._closed_loop import simulate_closed_loop

__all__ = ["simulate_closed_loop"]
