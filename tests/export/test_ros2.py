# SPDX-License-Identifier: BSD-3-Clause
"""The ROS 2 package: its plugin compiled against the interface and called, its YAML read."""

import shutil
import subprocess
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.effects import Term
from skidyn.export import write_ros2

STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1")

#: The interface that a plugin has to implement, and as much of Eigen and ROS 2 as it touches.
HEADERS = {
    "eigen3/Eigen/Core": """
        #pragma once
        #include <vector>
        namespace Eigen {
        class VectorXd {
         public:
          explicit VectorXd(int n) : v(n) {}
          double* data() { return v.data(); }
          const double* data() const { return v.data(); }
          long size() const { return static_cast<long>(v.size()); }
          double& operator()(int i) { return v[i]; }
          double operator()(int i) const { return v[i]; }
         private:
          std::vector<double> v;
        };
        class MatrixXd {
         public:
          MatrixXd(int n, int m) : rows(n), v(n * m) {}
          double& operator()(int i, int j) { return v[i + rows * j]; }
         private:
          int rows;
          std::vector<double> v;
        };
        }
    """,
    "rclcpp/node_interfaces/node_parameters_interface.hpp": """
        #pragma once
        #include <memory>
        namespace rclcpp { namespace node_interfaces {
        struct NodeParametersInterface {
          using ConstSharedPtr = std::shared_ptr<const NodeParametersInterface>;
        };
        } }
    """,
    "pluginlib/class_list_macros.hpp": """
        #pragma once
        #define PLUGINLIB_EXPORT_CLASS(own, base) base* make_plugin() { return new own; }
    """,
    "inverse_dynamics_solver/inverse_dynamics_solver.h": """
        #pragma once
        #include <string>
        #include <eigen3/Eigen/Core>
        #include <rclcpp/node_interfaces/node_parameters_interface.hpp>
        namespace inverse_dynamics_solver {
        using Vector = Eigen::VectorXd;
        class InverseDynamicsSolver {
         public:
          virtual ~InverseDynamicsSolver() {}
          virtual void initialize(
            rclcpp::node_interfaces::NodeParametersInterface::ConstSharedPtr = nullptr,
            const std::string& = "", const std::string& = "") = 0;
          virtual Eigen::MatrixXd getInertiaMatrix(const Vector&) const = 0;
          virtual Vector getCoriolisVector(const Vector&, const Vector&) const = 0;
          virtual Vector getGravityVector(const Vector&) const = 0;
          virtual Vector getFrictionVector(const Vector&) const = 0;
          virtual Vector getTorques(const Vector&, const Vector&, const Vector&) const = 0;
        };
        }
    """,
}
#: Reads q, dq and ddq, and prints inertia, Coriolis, gravity, friction and torque of each row.
CALLER = """
    #include <cstdio>
    #include <stdexcept>
    #include <inverse_dynamics_solver/inverse_dynamics_solver.h>
    inverse_dynamics_solver::InverseDynamicsSolver* make_plugin();
    int main(int, char** given) {
      const int n = given[1][0] - '0';
      auto solver = make_plugin();
      solver->initialize();
      try { solver->getGravityVector(Eigen::VectorXd(n + 1)); return 1; }
      catch (const std::invalid_argument&) {}
      Eigen::VectorXd s[3] = {Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n)};
      for (;;) {
        for (auto& x : s)
          for (int i = 0; i < n; ++i)
            if (std::scanf("%lf", x.data() + i) != 1) { delete solver; return 0; }
        auto H = solver->getInertiaMatrix(s[0]);
        for (int i = 0; i < n; ++i) for (int j = 0; j < n; ++j) std::printf("%.17g ", H(i, j));
        const Eigen::VectorXd vectors[] = {
          solver->getCoriolisVector(s[0], s[1]), solver->getGravityVector(s[0]),
          solver->getFrictionVector(s[1]), solver->getTorques(s[0], s[1], s[2])};
        for (const auto& v : vectors)
          for (int i = 0; i < n; ++i) std::printf("%.17g ", v(i));
        std::printf("\\n");
      }
    }
"""


def called(package, name, motion, folder):
    """What the compiled plugin answers: H, C, g, f and torques of every row."""
    if shutil.which("g++") is None or shutil.which("gcc") is None:
        pytest.skip("no C++ compiler")
    for path, text in HEADERS.items():
        file = folder / "include" / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    (folder / "main.cpp").write_text(CALLER)
    include = f"-I{folder / 'include'}"
    compile_c = [
        "gcc",
        "-std=c99",
        *STRICT,
        "-c",
        package / "src" / "model.c",
        "-o",
        folder / "m.o",
    ]
    subprocess.run(compile_c, check=True)
    sources = [package / "src" / "solver.cpp", folder / "main.cpp", folder / "m.o"]
    program = folder / "call"
    compile_cpp = ["g++", "-std=c++17", *STRICT, include, *sources, "-lm", "-o", program]
    subprocess.run(compile_cpp, check=True)
    n = motion[0].shape[1]
    text = "\n".join(" ".join(map(repr, map(float, row))) for row in np.hstack(motion))
    done = subprocess.run(
        [program, str(n)], input=text, capture_output=True, text=True, check=True
    ).stdout
    table = np.array([line.split() for line in done.splitlines()], dtype=float)
    return table[:, : n * n].reshape(-1, n, n), *np.split(table[:, n * n :], 4, axis=1)


@pytest.mark.parametrize("name", ["tree", pytest.param("scara", marks=pytest.mark.slow)])
def test_the_plugin_gives_the_torque_of_the_model(models, name, states, tmp_path):
    model = models[name]
    left = write_ros2(model, tmp_path / "own", package="own_dynamics")
    q, dq, ddq = states(model.robot_, 30)
    dq[-5:] = ddq[-5:] = 0.0
    H, C, g, f, torque = called(tmp_path / "own", "own_dynamics", (q, dq, ddq), tmp_path)
    names = {word.split(" of ")[0] for word in left}
    assert {"load_dependent_friction", "saturation"} <= names
    kept = {t: c for t, c in model.effect_coefficients_.items() if t.kind not in names}
    for term in list(model.effect_terms_):
        if term not in kept:
            model = without(model, term)
    expected = model.predict(np.hstack([q, dq, ddq]))
    np.testing.assert_allclose(torque + f, expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.einsum("kij,kj->ki", H, ddq) + C + g, torque, atol=1e-9)
    np.testing.assert_allclose(C[-5:], 0.0, atol=1e-12)
    np.testing.assert_allclose(g[-5:], torque[-5:], atol=1e-12)


def without(model, term):
    """The model without one of its effects."""
    import copy

    part = copy.copy(model)
    part.effect_terms_ = [t for t in model.effect_terms_ if t != term]
    return part


def test_a_robot_alone_has_no_friction(states, tmp_path):
    robot = load_planar_arm()
    assert write_ros2(robot, tmp_path / "own", package="arm") == ()
    motion = states(robot, 10)
    _, _, _, f, torque = called(tmp_path / "own", "arm", motion, tmp_path)
    assert not f.any()
    np.testing.assert_allclose(torque, robot.inverse_dynamics(*motion), atol=1e-12)


def test_parameters_are_arrays_in_the_order_of_the_joints(fit, load, tmp_path):
    yaml = pytest.importorskip("yaml")
    stribeck = Term("stribeck", (1,), {"vs": 0.1, "delta": 2.0})
    effects = ["viscous", "coulomb", "rotor_inertia", ("spring", [2]), stribeck]
    model = fit(load("scara"), effects, consistent=True)
    write_ros2(model, tmp_path, package="scara_dynamics")
    read = yaml.safe_load((tmp_path / "config" / "parameters.yaml").read_text())
    own = read["/**"]["ros__parameters"]["skidyn"]
    robot = model.robot_
    assert own["joints"] == list(robot.joint_names) and own["bodies"] == list(robot.body_names)
    assert own["gravity"] == list(robot.gravity)
    np.testing.assert_array_equal(own["mass"], model.inertial_parameters_[:, 0])
    first = np.reshape(own["first_moment"], (-1, 3))
    np.testing.assert_array_equal(first, model.inertial_parameters_[:, 1:4])
    for term, values in model.effect_coefficients_.items():
        for c, value in zip(term.effect.coefficients, values, strict=True):
            found = own[term.kind][c.name]
            assert found[term.joints[0] - 1] == value
            assert all(isinstance(x, float) for x in found)
    assert own["stribeck"]["vs"] == [0.1, 0.0, 0.0, 0.0]


def test_names_in_the_package_fit_together(tmp_path):
    write_ros2(load_planar_arm(), tmp_path, package="arm_dynamics")
    package = ElementTree.parse(tmp_path / "package.xml").getroot()
    assert package.findtext("name") == "arm_dynamics"
    plugin = ElementTree.parse(tmp_path / "arm_dynamics.xml").getroot()
    assert plugin.attrib["path"] == "arm_dynamics"
    assert plugin.find("class").attrib["type"] == "arm_dynamics::Solver"
    cmake = (tmp_path / "CMakeLists.txt").read_text()
    assert "project(arm_dynamics C CXX)" in cmake and "${PROJECT_NAME}" in cmake
    for name in ("Arm", "1arm", "arm-dynamics", ""):
        with pytest.raises(ValueError, match="package is"):
            write_ros2(load_planar_arm(), tmp_path, package=name)
