# SPDX-License-Identifier: BSD-3-Clause
"""Evidence: what identification and diagnosis need from a log, averaged once into few rows."""

from skidyn.evidence._evidence import Evidence
from skidyn.evidence._problem import Fit, Problem, make_problem
from skidyn.evidence._rows import Rows

__all__ = ["Evidence", "Fit", "Problem", "Rows", "make_problem"]
