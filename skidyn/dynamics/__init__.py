# SPDX-License-Identifier: BSD-3-Clause
"""Dynamics of kinematic trees: recursion, tape and back ends; independent of logs."""

# For other packages of skidyn; no part of the public interface.
from skidyn.dynamics._engine import Engine as Engine
from skidyn.dynamics._numpy import (
    BoundProgram as BoundProgram,
    chunk_size as chunk_size,
    evaluate_rows as evaluate_rows,
)
from skidyn.dynamics._recursion import Program as Program
from skidyn.dynamics._scalar import (
    ScalarFunction as ScalarFunction,
    python_function as python_function,
)
from skidyn.dynamics._source import C as C, renumber as renumber, statements as statements
from skidyn.dynamics._tape import Scalar as Scalar, Tape as Tape, operands as operands
from skidyn.dynamics._torch import evaluate_torch as evaluate_torch
from skidyn.dynamics._tree import (
    KinematicTree as KinematicTree,
    central_parts as central_parts,
    inertial_parts as inertial_parts,
    inertial_vector as inertial_vector,
    skew as skew,
    transform_inertial as transform_inertial,
)
