# SPDX-License-Identifier: BSD-3-Clause
"""Masses, centers of mass and inertias of a description that are in other units."""

import re
from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.logs import check_log
from skidyn.robots import Robot

CHECK, TORQUES = "description_units", ("tau1", "tau2", "tau3")


def arm(masses="4 3 2", centers="0.2 0.2 0.1", inertias="0.1 0.05 0.01", length=0.4):
    """A description of three links of 0.4 m with other masses, centers of mass and inertias."""
    bodies = zip(masses.split(), centers.split(), inertias.split(), strict=True)
    text = "".join(
        f"""<link name="part{k + 1}"><inertial><origin xyz="{center} 0 0"/><mass value="{mass}"/>
          <inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/>
          </inertial></link>
        <joint name="turn{k + 1}" type="revolute"><parent link="part{k}"/>
          <child link="part{k + 1}"/><origin xyz="{length * (k > 0)} 0 0"/><axis xyz="0 1 0"/>
          <limit lower="-3" upper="3" effort="1e5" velocity="9"/></joint>"""
        for k, (mass, center, inertia) in enumerate(bodies)
    )
    return Robot.from_urdf(f'<robot name="arm"><link name="part0"/>{text}</robot>')


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        arm(), "viscous", joints=[1], n_trajectories=3, duration=5.0, random_state=4
    ).frame


@pytest.fixture(scope="module")
def told(log):
    """Suspicions of the log with a description, those of its units first, then others."""

    def asked(robot, frame=log):
        checks = [s for s in check_log(frame, robot).checks if s.certainty != "noted"]
        own = [s for s in checks if s.check == CHECK]
        return own, [s.check for s in checks if s.check != CHECK]

    return asked


def test_a_description_in_si_units(told):
    assert told(arm()) == ([], [])


@pytest.mark.parametrize(
    ("change", "joints", "words"),
    [
        ({"inertias": "1e8 5e7 1e7"}, (1, 2, 3), "the inertia of all links .* in g mm.2"),
        ({"inertias": "0.1 5e4 0.01"}, (2,), "the inertia of link 'part2' .* in kg mm.2"),
        ({"centers": "200 200 100"}, (1, 2, 3), "the center of mass of all links .* in mm"),
        ({"centers": "0.2 0.2 100"}, (3,), "the center of mass of link 'part3' .* in mm"),
        ({"masses": "4000 3000 2000"}, (1, 2, 3), "the mass of all links .* in g instead"),
        ({"masses": "4 3 2000"}, (3,), "the mass of link 'part3' .* in g instead"),
    ],
)
def test_one_quantity_in_another_unit(told, change, joints, words):
    (one,), others = told(arm(**change))
    assert re.search(words, one.suspicion)
    assert (one.certainty, one.joints, one.remedy) == ("certain", joints, None)
    assert "Correct the description" in one.evidence
    assert others == []  # no gain of a torque, since all others use the right units


def test_everything_in_grams_and_millimetres(told):
    found, others = told(arm("4000 3000 2000", "200 200 100", "1e8 5e7 1e7"))
    units = [s.suspicion.split(" to be in ")[1] for s in found]
    assert set(units) == {"g instead of kg", "mm instead of m", "g mm^2 instead of kg m^2"}
    assert others == []


def test_a_log_that_tells_nothing_leaves_it_suspected(log, told):
    noise = np.random.default_rng(0).normal(size=(len(log), 3))
    (one,), _ = told(
        arm(inertias="1e8 5e7 1e7"), log.assign(**dict(zip(TORQUES, noise.T, strict=True)))
    )
    assert one.certainty == "suspected"


def test_a_torque_of_the_stated_bodies_confirms_them(log, told):
    heavy = log.assign(**{name: 1e3 * log[name] for name in TORQUES})
    assert told(arm("4000 3000 2000", inertias="100 50 10"), heavy) == ([], [])


def test_a_correct_gain_is_still_found(log, told):
    scaled = log.assign(**{name: 0.05 * log[name] for name in TORQUES})
    (one,), others = told(arm(centers="200 200 100"), scaled)
    assert " in mm " in one.suspicion
    assert others == ["torque_scale"]


@pytest.mark.slow
def test_one_link_of_a_larger_arm():
    robot = load_ur5()
    parameters = np.array(robot.inertial_parameters, dtype=float)
    parameters[3, 4:] *= 1e6
    frame = make_hidden_effect_log(robot, None, n_trajectories=3, duration=5.0, random_state=7)
    checks = check_log(frame.frame, replace(robot, inertial_parameters=parameters)).checks
    (one,) = [s for s in checks if s.check == CHECK]
    assert one.joints == (4,)
    assert "torque_scale" not in {s.check for s in checks}


def test_the_influence_of_remedies_is_that_with_the_right_units(log):
    flipped = log.assign(tau2=-log["tau2"])
    told, alone = (
        {s.check: s for s in check_log(flipped, robot).checks if s.certainty == "certain"}
        for robot in (arm(centers="200 200 100"), arm())
    )
    assert told["reading"].remedy == alone["reading"].remedy
    assert told["reading"].influence == pytest.approx(alone["reading"].influence, rel=1e-6)
    assert told[CHECK].influence > 0.99


def test_lengths_in_millimetres():
    log = make_hidden_effect_log(arm(), None, n_trajectories=3, duration=5.0, random_state=1)
    (told,) = check_log(log.frame, arm(centers="200 200 100", length=400.0)).checks
    assert (told.check, told.certainty) == ("description_lengths", "certain")
    assert "in mm instead of m" in told.suspicion
    assert not any(s.check == "description_lengths" for s in check_log(log.frame, arm()).checks)
