# SPDX-License-Identifier: BSD-3-Clause
"""The exported Python module, run where there is NumPy only."""

import subprocess
import sys

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm
from skidyn.export import python_source, write_python
from skidyn.robots import Robot

SCRIPT = """
import sys
import numpy as np
for name in ("skidyn", "torch", "scipy", "sklearn"):
    sys.modules[name] = None  # an import of it fails
import model
np.save("tau.npy", model.inverse_dynamics(*np.load("states.npy")))
"""


@pytest.mark.parametrize("name", ["tree", "scara"])
def test_every_static_effect_equals_predict_with_numpy_only(models, name, tmp_path, states):
    model = models[name]
    motion = states(model.robot_)
    write_python(model, tmp_path / "model.py")
    np.save(tmp_path / "states.npy", motion)
    subprocess.run([sys.executable, "-c", SCRIPT], cwd=tmp_path, check=True)
    expected = model.predict(np.hstack(motion))
    np.testing.assert_allclose(np.load(tmp_path / "tau.npy"), expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("name", ["ur5", "panda", "planar_arm"])
def test_consistent_models_equal_predict(consistent, name, states):
    model, namespace = consistent[name], {}
    exec(python_source(model, name="torque"), namespace)
    motion = states(model.robot_)
    expected = model.predict(np.hstack(motion))
    np.testing.assert_allclose(namespace["torque"](*motion), expected, rtol=1e-10, atol=1e-10)


def test_joint_names_are_only_data():
    evil = '*/ int x; /* """ + '
    robot = Robot.from_urdf(
        '<robot name="*/ r"><link name="a"/><link name="b"><inertial><mass value="1"/></inertial>'
        f"</link><joint name='{evil}' type='continuous'><parent link='a'/><child link='b'/></joint>"
        "</robot>"
    )
    namespace = {}
    exec(python_source(robot), namespace)
    assert namespace["JOINTS"] == robot.joint_names


@pytest.mark.parametrize("name", ["", "1st", "a b", "class"])
def test_names_are_checked(name):
    with pytest.raises(ValueError, match="name is"):
        python_source(load_planar_arm(), name=name)
