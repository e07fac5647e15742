# SPDX-License-Identifier: BSD-3-Clause
"""Robots: read from a URDF, checked, with batched rigid-body dynamics."""

from skidyn.robots._robot import Robot

__all__ = ["Robot"]
