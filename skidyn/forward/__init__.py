# SPDX-License-Identifier: BSD-3-Clause
"""Motion of a model from its torque: implicit steps with set-valued friction, vectorised."""

# For other packages of skidyn; no part of the public interface.
from skidyn.forward._controller import Controller as Controller, fit_controller as fit_controller
from skidyn.forward._joint_loop import JointLoop as JointLoop
from skidyn.forward._model import ForwardModel as ForwardModel
from skidyn.forward._run import (
    STEP as STEP,
    Task as Task,
    commanded as commanded,
    read_task as read_task,
    references as references,
    robot_of as robot_of,
    run as run,
)
from skidyn.forward._windows import make_windows as make_windows
