# SPDX-License-Identifier: BSD-3-Clause
"""Export of models as functions and robot descriptions, and of torques for log viewers."""

from skidyn.export._bam import BamModel, read_bam, write_bam
from skidyn.export._bam_fit import fit_bam
from skidyn.export._c import c_source, write_c
from skidyn.export._merge import merge_mjcf, merge_urdf
from skidyn.export._mjcf import write_mjcf
from skidyn.export._onnx import to_onnx, write_onnx
from skidyn.export._python import python_source, write_python
from skidyn.export._ros2 import write_ros2
from skidyn.export._traces import write_traces
from skidyn.export._urdf import write_urdf
from skidyn.export._usd import merge_usd

__all__ = [
    "BamModel",
    "c_source",
    "fit_bam",
    "merge_mjcf",
    "merge_urdf",
    "merge_usd",
    "python_source",
    "read_bam",
    "to_onnx",
    "write_bam",
    "write_c",
    "write_mjcf",
    "write_onnx",
    "write_python",
    "write_ros2",
    "write_traces",
    "write_urdf",
]

# For other packages of skidyn; no part of the public interface.
from skidyn.export._bam import (
    checked_actuator as checked_actuator,
    friction_budget as friction_budget,
    friction_parameters as friction_parameters,
)
from skidyn.export._model import (
    check_model as check_model,
    static_model as static_model,
)
