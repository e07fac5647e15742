# SPDX-License-Identifier: BSD-3-Clause
"""Models out of skidyn: C and Python functions for feedforward, URDF and MJCF descriptions."""

from skidyn.export._c import c_source
from skidyn.export._mjcf import write_mjcf
from skidyn.export._model import model_terms
from skidyn.export._python import python_source
from skidyn.export._urdf import write_urdf

__all__ = ["c_source", "model_terms", "python_source", "write_mjcf", "write_urdf"]
