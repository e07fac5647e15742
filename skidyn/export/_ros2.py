# SPDX-License-Identifier: BSD-3-Clause
"""A model as a ROS 2 package: a plugin of ``inverse_dynamics_solver``, and parameters as YAML."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn._writing import write_text
from skidyn.dynamics import Program
from skidyn.effects import Term
from skidyn.export._c import function_text, printable
from skidyn.export._files import PathLike, write_files
from skidyn.export._model import StaticModel, is_carried, random_signals, static_model, traced
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

#: Permitted relative difference from the model on random numbers.
_ROUNDING = 1e-9

_PACKAGE = """\
<?xml version="1.0"?>
<package format="3">
  <name>{package}</name>
  <version>0.0.1</version>
  <description>Inverse dynamics of {robot}, identified by skidyn.</description>
  <maintainer email="nobody@example.com">nobody</maintainer>
  <license>BSD-3-Clause</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <depend>inverse_dynamics_solver</depend>
  <depend>pluginlib</depend>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""

_CMAKE = """\
cmake_minimum_required(VERSION 3.8)
project({package} C CXX)

find_package(ament_cmake REQUIRED)
find_package(inverse_dynamics_solver REQUIRED)
find_package(pluginlib REQUIRED)

add_library({package} SHARED src/model.c src/solver.cpp)
target_compile_features({package} PUBLIC c_std_99 cxx_std_17)
ament_target_dependencies({package} inverse_dynamics_solver pluginlib)
pluginlib_export_plugin_description_file(inverse_dynamics_solver {package}.xml)

install(TARGETS {package} ARCHIVE DESTINATION lib LIBRARY DESTINATION lib RUNTIME DESTINATION bin)
install(DIRECTORY config DESTINATION share/${{PROJECT_NAME}})
ament_package()
"""

_PLUGIN = """\
<library path="{package}">
  <class name="{package}/Solver" type="{package}::Solver"
         base_class_type="inverse_dynamics_solver::InverseDynamicsSolver">
    <description>Inverse dynamics of {robot}, identified by skidyn.</description>
  </class>
</library>
"""

_SOLVER = """\
// Inverse dynamics of {robot} as a plugin of inverse_dynamics_solver. Written by skidyn.
// Joints, in this order: {joints}.
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <inverse_dynamics_solver/inverse_dynamics_solver.h>
#include <pluginlib/class_list_macros.hpp>

extern "C" {{
void {package}_bodies(const double * q, const double * dq, const double * ddq, double * tau);
void {package}_friction(const double * q, const double * dq, const double * ddq, double * tau);
}}

namespace {package}
{{

class Solver : public inverse_dynamics_solver::InverseDynamicsSolver
{{
public:
  void initialize(
    rclcpp::node_interfaces::NodeParametersInterface::ConstSharedPtr, const std::string &,
    const std::string &) override
  {{
  }}

  Eigen::MatrixXd getInertiaMatrix(const Eigen::VectorXd & q) const override
  {{
    const Eigen::VectorXd rest = getGravityVector(q);
    std::vector<double> unit({n}, 0.0);
    Eigen::MatrixXd inertia({n}, {n});
    double tau[{n}];
    for (int j = 0; j < {n}; ++j) {{
      unit[j] = 1.0;
      {package}_bodies(q.data(), zero(), unit.data(), tau);
      unit[j] = 0.0;
      for (int i = 0; i < {n}; ++i) {{
        inertia(i, j) = tau[i] - rest(i);
      }}
    }}
    return inertia;
  }}

  Eigen::VectorXd getCoriolisVector(
    const Eigen::VectorXd & q, const Eigen::VectorXd & dq) const override
  {{
    const Eigen::VectorXd rest = getGravityVector(q);
    Eigen::VectorXd tau({n});
    {package}_bodies(checked(q), checked(dq), zero(), tau.data());
    for (int i = 0; i < {n}; ++i) {{
      tau(i) -= rest(i);
    }}
    return tau;
  }}

  Eigen::VectorXd getGravityVector(const Eigen::VectorXd & q) const override
  {{
    Eigen::VectorXd tau({n});
    {package}_bodies(checked(q), zero(), zero(), tau.data());
    return tau;
  }}

  Eigen::VectorXd getFrictionVector(const Eigen::VectorXd & dq) const override
  {{
    Eigen::VectorXd tau({n});
    {package}_friction(zero(), checked(dq), zero(), tau.data());
    return tau;
  }}

  Eigen::VectorXd getTorques(
    const Eigen::VectorXd & q, const Eigen::VectorXd & dq,
    const Eigen::VectorXd & ddq) const override
  {{
    Eigen::VectorXd tau({n});
    {package}_bodies(checked(q), checked(dq), checked(ddq), tau.data());
    return tau;
  }}

private:
  static const double * zero()
  {{
    static const double values[{n}] = {{0.0}};
    return values;
  }}

  static const double * checked(const Eigen::VectorXd & values)
  {{
    if (values.size() != {n}) {{
      throw std::invalid_argument(
        "expected {n} joints, got " + std::to_string(static_cast<long>(values.size())));
    }}
    return values.data();
  }}
}};

}}  // namespace {package}

PLUGINLIB_EXPORT_CLASS({package}::Solver, inverse_dynamics_solver::InverseDynamicsSolver)
"""


def write_ros2(model: RBDRegressor | Robot, path: PathLike, *, package: str) -> tuple[str, ...]:
    """Write a ROS 2 package with the model as a plugin and its parameters as YAML.

    The plugin has the interface of ``inverse_dynamics_solver`` [1]_: inertia matrix, Coriolis,
    gravity and friction vectors and, without friction, torques. Its model is a C file that does not
    depend on skidyn. ``config/parameters.yaml`` has gravity, masses and first moments of the
    bodies, and coefficients of the effects on single joints as arrays in the order of the joints.

    Parameters
    ----------
    model : RBDRegressor or Robot
        Fitted model, or a robot for the rigid bodies of its description.
    path : path
        Folder of the package, which is created; files of an earlier export are replaced.
    package : str
        Name of the package: lower-case letters, digits and underscores.

    Returns
    -------
    tuple of str
        Names of the effects that the interface cannot represent: those with a memory, and those
        whose torque is not the sum of a part that is linear in the acceleration and a friction that
        depends on the velocity only, such as load-dependent friction. They are written to
        ``src/model.c.skidyn.json``.

    Raises
    ------
    SkidynError
        The package has no valid name, or the model is not fitted.

    References
    ----------
    .. [1] V. Petrone, E. Ferrentino, P. Chiacchio (2025), The dynamic model of the UR10 robot and
       its ROS2 integration, IEEE Trans. Industrial Informatics; package of the Automatic Control
       Group of the University of Salerno.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import write_ros2
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     left = write_ros2(load_planar_arm(), folder, package="arm_dynamics")
    ...     sorted(p.name for p in pathlib.Path(folder).iterdir())
    ['CMakeLists.txt', 'arm_dynamics.xml', 'config', 'package.xml', 'src']
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", package):
        raise SkidynError(
            f"package is {package!r}; expected lower-case letters, digits and underscores, such as "
            "'arm_dynamics'"
        )
    bodies, friction = _halves(model)
    robot, folder = bodies.robot, Path(path)
    words = {
        "package": package,
        "robot": printable(robot.name),
        "joints": printable(", ".join(robot.joint_names)),
        "n": robot.n_joints,
    }
    source = "\n".join(
        function_text(half, f"{package}_{name}")
        for half, name in ((bodies, "bodies"), (friction, "friction"))
    )
    left = write_files(folder / "src" / "model.c", source, model, bodies.left)
    for name, template in (
        ("package.xml", _PACKAGE),
        ("CMakeLists.txt", _CMAKE),
        (f"{package}.xml", _PLUGIN),
        ("src/solver.cpp", _SOLVER),
    ):
        write_text(folder / name, template.format(**words))
    held = [*bodies.held, *friction.held]
    write_text(folder / "config" / "parameters.yaml", _parameters(model, robot, held))
    return left


def _halves(model: RBDRegressor | Robot) -> tuple[StaticModel, StaticModel]:
    """The model as two functions: one linear in acceleration, and friction of velocity."""
    if isinstance(model, Robot):
        static = static_model(model)
        tape = copy.deepcopy(static.program.tape)
        nothing: dict[tuple[int, ...], Any] = {
            (j,): tape.constant(0.0) for j in range(model.n_joints)
        }
        return static, StaticModel(model, Program(tape, nothing, (model.n_joints,)), [], [])
    static = static_model(model)
    held = [term for term in static.held if _is_of_bodies(model, term) or _is_friction(model, term)]
    friction = [term for term in held if _is_friction(model, term)]
    bodies = [term for term in held if term not in friction]
    if not _add_up(model, bodies, friction):
        bodies = [term for term in bodies if not term.effect.needs_fit]
    left = [term for term in model.effect_terms_ if term not in (*bodies, *friction)]
    still = copy.copy(model)
    still.inertial_parameters_ = np.zeros_like(model.inertial_parameters_)
    return (
        StaticModel(model.robot_, traced(model, bodies), bodies, left),
        StaticModel(model.robot_, traced(still, friction), friction, []),
    )


def _torque(
    model: RBDRegressor, terms: Sequence[Term], bodies: bool = True, **changed: Any
) -> Array:
    part = copy.copy(model)
    part.effect_terms_ = list(terms)
    if not bodies:
        part.inertial_parameters_ = np.zeros_like(model.inertial_parameters_)
    return part._torque(random_signals(model.robot_).with_(**changed))


def _alike(a: Array, b: Array) -> bool:
    return bool(np.abs(a - b).max() <= _ROUNDING * (1.0 + np.abs(b).max()))


def _is_friction(model: RBDRegressor, term: Term) -> bool:
    """Whether a term depends on the velocity only."""
    if term.effect.follows_fit or is_carried(term):
        return False
    signals = random_signals(model.robot_)
    own = _torque(model, [term], bodies=False)
    still = {"q": 0 * signals.q, "ddq": 0 * signals.ddq}
    return _alike(_torque(model, [term], bodies=False, **still), own) and not _alike(
        _torque(model, [term], bodies=False, dq=0 * signals.dq), own
    )


def _is_of_bodies(model: RBDRegressor, term: Term) -> bool:
    """Whether the torque is a pose-dependent inertia times the acceleration plus the rest."""
    signals = random_signals(model.robot_)
    zero, n = 0 * signals.q, signals.n_joints
    rest = _torque(model, [term], dq=zero, ddq=zero)
    torque = _torque(model, [term], ddq=zero)
    for j in range(n):
        unit = zero + np.eye(n)[j]
        column = _torque(model, [term], dq=zero, ddq=unit) - rest
        torque = torque + column * signals.ddq[:, [j]]
    return _alike(torque, _torque(model, [term]))


def _add_up(model: RBDRegressor, bodies: Sequence[Term], friction: Sequence[Term]) -> bool:
    together = [t for t in model.effect_terms_ if t in (*bodies, *friction)]
    halves = _torque(model, bodies) + _torque(model, friction, bodies=False)
    return _alike(halves, _torque(model, together))


def _parameters(model: RBDRegressor | Robot, robot: Robot, held: Sequence[Term]) -> str:
    """Gravity, bodies and coefficients of effects as parameters of a ROS 2 node."""
    inertial = robot.inertial_parameters
    values: dict[str, dict[str, Any]] = {}
    if not isinstance(model, Robot):
        inertial = model.inertial_parameters_.copy()
        for term in held:
            if is_carried(term):
                inertial[-1] += model.effect_coefficients_[term]
            elif len(term.joints) == 1:
                _add_coefficients(values, model, term)
    lines = [
        f"# Model of {printable(robot.name)}, written by skidyn. SI units.",
        "/**:",
        "  ros__parameters:",
        "    skidyn:",
        f"      joints: {_array(robot.joint_names)}",
        f"      gravity: {_array(robot.gravity)}",
        f"      bodies: {_array(robot.body_names)}",
        f"      mass: {_array(inertial[:, 0])}",
        f"      first_moment: {_array(inertial[:, 1:4].ravel())}",
    ]
    for kind, own in values.items():
        lines.append(f"      {kind}:")
        lines += [f"        {name}: {_array(row)}" for name, row in own.items()]
    return "\n".join(lines) + "\n"


def _add_coefficients(values: dict[str, dict[str, Any]], model: RBDRegressor, term: Term) -> None:
    """A term's numbers at the index of its joint; a second term or form of a kind gets a number."""
    (j,), number = term.places, 1
    names = [c.name for c in term.coefficients]
    own = dict(zip(names, model.effect_coefficients_[term], strict=True))
    own |= {k: v for k, v in term.shape.items() if isinstance(v, int | float)}
    while True:
        kind = term.kind if number == 1 else f"{term.kind}_{number}"
        rows = values.setdefault(kind, {k: np.zeros(model.robot_.n_joints) for k in own})
        if rows.keys() == own.keys() and not any(rows[name][j] for name in rows):
            break
        number += 1
    for name, value in own.items():
        rows[name][j] = value


def _array(values: Any) -> str:
    """A list in YAML; numbers as doubles, which ROS 2 does not mix with integers."""
    written = [json.dumps(v) if isinstance(v, str) else _number(float(v)) for v in values]
    return f"[{', '.join(written)}]"


def _number(value: float) -> str:
    text = repr(value + 0.0)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text
