# SPDX-License-Identifier: BSD-3-Clause
"""Elasticity and backlash of gears as passive joints in series, for MuJoCo."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._text import listed
from skidyn.effects import Term
from skidyn.export._bodies import Description, numbers
from skidyn.export._edits import Edits, Element
from skidyn.export._model import is_lasting
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

#: End of the name of the passive joint, by the kind of its effect. The second is that of
#: onshape-to-robot, by which the models of BAM's authors were made.
SUFFIX = {"joint_elasticity": "_elasticity", "backlash": "_backlash"}


@dataclass(frozen=True)
class SeriesJoint:
    """Passive joint between the motor's side and the link's side of a gear.

    The motor's joint keeps its name, friction, armature and actuator, and its coordinate is the
    logged position; that of the passive joint is the position of the link minus that of the motor.
    ``place`` is the joint of the robot, from 0. A gap (rad or m, the whole play) has no stiffness
    (N m/rad or N/m) and no damping parallel to it.
    """

    place: int
    name: str
    stiffness: float = 0.0
    damping: float = 0.0
    gap: float = 0.0

    def attributes(self, per_unit: float = 1.0) -> dict[str, str]:
        """Attributes other than those that place the joint; ``per_unit`` is one rad in the file.

        All are given, since MuJoCo takes missing ones from defaults of the file, which are those of
        the motor's joint.
        """
        half = self.gap / 2 * per_unit
        return {
            "name": self.name,
            "limited": "true" if self.gap else "false",
            "range": numbers([-half, half]),
            "stiffness": numbers(self.stiffness),
            "springref": "0",
            "springdamper": "0 0",
            "ref": "0",
            "damping": numbers(self.damping),
            "frictionloss": "0",
            "armature": "0",
            "margin": "0",
        }


def series_joints(
    model: RBDRegressor | Robot, own: Description
) -> tuple[dict[Term, SeriesJoint], dict[Term, str]]:
    """Passive joints for effects left in the description, and reasons why other such have none."""
    joints: dict[Term, SeriesJoint] = {}
    reasons: dict[Term, str] = {}
    if isinstance(model, Robot):
        return joints, reasons
    taken: dict[int, str] = {}
    followed = [name for name in model.robot_.body_joints if name not in model.robot_.joint_names]
    for term in own.left:
        if term.kind not in SUFFIX:
            continue
        place = term.places[0]
        name = model.robot_.joint_names[place]
        size = float(model.effect_coefficients_[term][0])
        if not is_lasting(term):
            reasons[term] = "it acts in some of the recordings only"
        elif not size > 0.0:
            reasons[term] = "its size is not positive"
        elif "stiffening" in term.shape:
            reasons[term] = "its stiffness changes with the load"
        elif place in taken:
            # Two passive joints need a body with mass between them.
            reasons[term] = f"the joint has its {taken[place]} already"
        elif not own.joints["rotor_inertia"][place, 0] > 0.0:
            reasons[term] = "a motor that is not rigidly connected to its link needs rotor inertia"
        elif any(_leads(model.robot_, place, follower) for follower in followed):
            reasons[term] = "other joints follow this one"
        else:
            taken[place] = term.kind
            joints[term] = _of_term(term, place, name + SUFFIX[term.kind], size)
    return joints, reasons


def _leads(robot: Robot, place: int, follower: str) -> bool:
    return int(robot.tree.coordinates[robot.body_joints.index(follower)]) == place


def _of_term(term: Term, place: int, name: str, size: float) -> SeriesJoint:
    if term.kind == "backlash":
        return SeriesJoint(place, name, gap=size * float(term.shape["gap"]))
    stiffness = 1.0 / size
    # The damping ratio of the effect is that at its resonance with a fixed motor.
    damping = 2.0 * float(term.shape["damping"]) * stiffness
    return SeriesJoint(
        place, name, stiffness, damping / (2.0 * np.pi * float(term.shape["resonance"]))
    )


def insert_series(
    edits: Edits,
    motors: Mapping[str, Element],
    bodies: Mapping[str, Element],
    taken: Collection[str],
    n_keyframes: int,
    joints: dict[Term, SeriesJoint],
    robot: Robot,
) -> dict[Term, str]:
    """Insert passive joints after those of their motors, or replace those of an earlier export.

    ``motors`` and ``bodies`` are the joints of the file and their bodies, by name of the joint;
    included files count in the names ``taken`` and in the keyframes. Joints that cannot be inserted
    are removed from ``joints``, and the reasons returned.
    """
    compiler = edits.root.find("compiler")
    degrees = compiler is None or compiler.attributes.get("angle", "degree") == "degree"
    stored = _stored_positions(edits.root, n_keyframes)
    reasons = {}
    for term, joint in list(joints.items()):
        name = robot.joint_names[joint.place]
        siblings = [own for own in motors if own != name and bodies[own] is bodies[name]]
        for suffix in SUFFIX.values():
            if name + suffix in siblings and name + suffix != joint.name:
                raise SkidynError(
                    f"{edits.path}: joint {name!r} has the passive joint {name + suffix!r}, and "
                    f"two of them cannot be in series; remove it to have {joint.name!r}"
                )
        if joint.name in taken and joint.name not in siblings:
            raise SkidynError(
                f"{edits.path}: the name {joint.name!r} of the passive joint for the {term.kind} "
                f"of {name!r} is that of another joint; rename that"
            )
        turns = degrees and robot.joint_types[joint.place] != "prismatic"
        given = motors[name].attributes
        values = {k: v for k, v in given.items() if k in ("class", "type", "pos", "axis")}
        values |= joint.attributes(float(np.rad2deg(1.0)) if turns else 1.0)
        text = " ".join(f"{key}={quoteattr(value)}" for key, value in values.items())
        if joint.name in siblings:
            edits.replace(motors[joint.name], f"<joint {text}/>")
        elif stored:
            reasons[term] = f"{stored} would need a number more; remove it to have the joint"
            del joints[term]
        else:
            edits.insert_after(motors[name], f"<joint {text}/>")
    return reasons


def _stored_positions(root: Element, n_keyframes: int) -> str:
    """Keyframes whose length depends on the number of joints, in words; empty if there are none."""
    keys = [k for e in root.children if e.tag == "keyframe" for k in e.children if k.tag == "key"]
    if n_keyframes > len(keys):
        return "a keyframe of an included file"
    keys = [key for key in keys if {"qpos", "qvel"} & key.attributes.keys()]
    names = [repr(key.attributes.get("name", "without name")) for key in keys]
    return f"keyframe {listed(names)}" if names else ""
