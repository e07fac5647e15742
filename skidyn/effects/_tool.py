# SPDX-License-Identifier: BSD-3-Clause
"""Loads and contacts of the tool, in all or in some of the trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._exceptions import EffectError
from skidyn._signals import Array, Signals
from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient, Shape
from skidyn.effects._springs import FEWEST_TOUCHING, MOST_TOUCHING

if TYPE_CHECKING:
    from skidyn.robots import Robot


#: Distance in m of a link that is fixed to the last body from which it is another point of it.
_ANOTHER_POINT = 0.01


def _tip(robot: Robot) -> str | None:
    """Name of the link farthest from the origin of the last body to which it is fixed.

    That of a tool or a flange, by which a robot touches its environment; None if there is none.
    """
    fixed = {
        name: float(np.linalg.norm(link.translation))
        for name, link in robot.links.items()
        if link.body == robot.n_bodies - 1
    }
    farthest = max(fixed, key=lambda name: fixed[name], default=None)
    return farthest if farthest and fixed[farthest] > _ANOTHER_POINT else None


def points_of_tool(signals: Signals) -> list[dict[str, str]]:
    """Shapes of the points at which something may touch the tool: its origin, and its tip."""
    assert signals.robot is not None
    name = _tip(signals.robot)
    return [{}] if name is None else [{}, {"point": name}]


def _tool_pose(signals: Signals, shape: Mapping[str, Any]) -> tuple[Array, Array]:
    """Position and orientation of the tool, (n_samples, 3) and (n_samples, 3, 3), computed once."""
    robot, point = signals.robot, shape.get("point", -1)
    assert robot is not None
    pose: tuple[Array, Array] = signals.once(
        f"tool {point}", lambda: robot.forward_kinematics(signals.q, point)
    )
    return pose


def tool_position(signals: Signals, shape: Mapping[str, Any]) -> Array:
    """Position of the tool in m, (n_samples, 3), computed once for all shapes.

    Parameters
    ----------
    signals : Signals
        Motion and robot.
    shape : mapping
        Shape of an effect; its ``point`` is the link that is taken for the tool. Without it, that
        is the last body.
    """
    return _tool_pose(signals, shape)[0]


def tool_jacobian(signals: Signals, shape: Mapping[str, Any]) -> Array:
    """Its velocity per unit joint velocity, (n_samples, 3, n_joints), computed once."""
    robot, point = signals.robot, shape.get("point", -1)
    assert robot is not None
    jacobian: Array = signals.once(
        f"tool jacobian {point}",
        lambda: robot.jacobian(signals.q, point)[:, :3].copy(order="K"),
    )
    return jacobian


def _turning_jacobian(signals: Signals) -> Array:
    """Its angular velocity per unit joint velocity, (n_samples, 3, n_joints), computed once."""
    robot = signals.robot
    assert robot is not None
    jacobian: Array = signals.once(
        "turning jacobian", lambda: robot.jacobian(signals.q)[:, 3:].copy(order="K")
    )
    return jacobian


#: Change of a direction of the tool below which the frames of tool and base are the same.
_LEAST_TURN = 0.05
#: Distance of a centre of mass from its link, in m, beyond which the mass is not determined.
FARTHEST = 5.0


#: Least share of a force that is across gravity for it not to be a weight.
LEAST_ASIDE = 0.2


class _ToolEffect(Effect):
    scope = "robot"
    needs = ("robot",)
    #: The trajectories with the payload are found by a split of the per-trajectory estimates.
    search = "trajectories"
    drifts = True

    def not_shown(self, signals: Signals, joint: int) -> str | None:
        if len(np.unique(signals.trajectory)) < 2:
            return "there is only one trajectory, which cannot be compared with others"
        return None


class Payload(_ToolEffect):
    """A rigid body fixed to the last link.

    With ``link`` in its shape it is fixed to the link that this joint moves, counted from 0.
    """

    kind = "payload"
    is_exact = True
    is_body = True
    drawn_against = "q"
    title = "Payload"
    formula = r"Y_n(q, \dot q, \ddot q)\,\pi_\mathrm{payload}"
    coefficients = (
        Coefficient("mass", "kg", is_divisor=True),
        Coefficient("mcx", "kg m"),
        Coefficient("mcy", "kg m"),
        Coefficient("mcz", "kg m"),
        *(Coefficient(name, "kg m^2") for name in ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")),
    )
    places = ("link",)
    # With bodies that are not exact, a load fits a little better on a link that does not have it.
    elsewhere_must_gain = 1.5
    # The inertia of a payload is determined only by many trajectories together.
    leading = 4
    grows = True
    simplicity = 27
    caveat = (
        "this data cannot separate mass from drive gain: the mass scales with the "
        "calibration of the torque"
    )
    rivals = ("external_wrench", "torque_gain")
    separating_motion = "the same motion with and without the payload, in poses that turn it over"
    reference = "Khalil, Gautier, Lemoine (2007), ICRA, 1943-1948."

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        robot = signals.robot
        assert robot is not None
        columns = np.empty((signals.n_joints, signals.n_samples, 10))
        bodies = len(robot.tree.parents)
        link = shape.get("link", bodies - 1)
        if link not in range(bodies):
            raise EffectError(
                f"payload: link={link!r}; expected a whole number from 0 to {bodies - 1}, that of "
                "the joint that moves the link, counted from 0"
            )
        motion = signals.q, signals.dq, signals.ddq
        for rows, chunk in robot.iter_torque_regressor(*motion, body=int(link)):
            columns[:, rows] = chunk.transpose(0, 2, 1)
        return {j: columns[j] for j in joints}

    def elsewhere(self, signals: Signals) -> list[dict[str, Any]]:
        assert signals.robot is not None
        bodies = len(signals.robot.tree.parents)
        # Bodies that mimic others have no joint of their own.
        others = range(1, bodies - 1) if bodies == signals.n_joints else ()
        return [{"link": link} for link in others]

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        mass, moment = float(coefficients[0]), [float(v) for v in coefficients[1:4]]
        if max(map(abs, moment)) > FARTHEST * abs(mass):
            # Its mass is not determined, as by too few joints or on a single pendulum.
            return {f"first_moment_{a}": v for a, v in zip("xyz", moment, strict=True)}
        place = {f"com_{a}": v / mass if mass else 0.0 for a, v in zip("xyz", moment, strict=True)}
        return {"mass": mass, **place}

    def meaning(self, parameters: Mapping[str, Mapping[str, Any]]) -> str:
        if parameters.get("mass", {}).get("value", 0.0) >= 0:
            return ""
        return "The mass is negative: the description includes a load that the robot does not have."

    def units(self, prismatic: bool = False) -> dict[str, str]:
        moment = {f"first_moment_{a}": "kg m" for a in "xyz"}
        return {"mass": "kg", **{f"com_{a}": "m" for a in "xyz"}, **moment}


class ExternalWrench(_ToolEffect):
    r"""A constant force on the tool: a hose, a spring balancer, a hand that pulls.

    If it does not act at the origin of the tool, its moment about the origin is constant, too. Its
    direction is that in the frame of the base, or, with ``on_tool``, that in the frame of the tool,
    as of a jet or a propeller. With ``arm`` in its shape, a force in the frame of the base pulls at
    a point that turns with the tool, as a hose that is fixed to it somewhere: its moment is
    :math:`(R\,p) \times f`, linear in the products of the coordinates of the point and the force.
    The tool is the origin of the last body, or with ``point`` the link of this name that is fixed
    to it.
    """

    kind = "external_wrench"
    drawn_against = "time"
    title = "External force at the tool"
    formula = r"-J_n(q)^\top f"
    coefficients = (
        *(Coefficient(f"f{axis}", "N") for axis in "xyz"),
        *(Coefficient(f"m{axis}", "N m") for axis in "xyz"),
    )
    forms = ({"on_tool": 1.0}, {"arm": 1.0})
    places = ("point",)
    # One trajectory determines a force, and a moment only if it turns the tool about all axes.
    leading = 3
    simplicity = 28
    rivals = ("payload", "environment_contact")
    separating_motion = "the tool moved through several orientations while the force acts"
    reference = "Khatib (1987), IEEE JRA 3(1), 43-53."

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        parts = [tool_jacobian(signals, shape), _turning_jacobian(signals)]
        if "arm" in shape:
            axes = _tool_pose(signals, {})[1].transpose(0, 2, 1)
            # the moment of a unit force along each axis of the base, a metre along one of the tool
            moments = np.cross(axes[:, :, None], np.eye(3))
            parts[1] = np.einsum("nabk,nkj->nabj", moments, parts[1])
            parts[1] = parts[1].reshape(len(axes), 9, -1)
        if "on_tool" in shape:
            orientation = _tool_pose(signals, {})[1]
            parts = [np.einsum("iab,iaj->ibj", orientation, part) for part in parts]
        return {j: -np.hstack([part[:, :, j] for part in parts]) for j in joints}

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        orientation = _tool_pose(signals, {})[1]
        turns = np.ptp(orientation, axis=0).max(initial=0.0) > _LEAST_TURN
        return super().grid(signals, joints) if turns else [{}]

    def elsewhere(self, signals: Signals) -> list[dict[str, Any]]:
        return list(points_of_tool(signals)[1:])

    def coefficients_of(self, shape: Mapping[str, Any]) -> tuple[Coefficient, ...]:
        if "arm" not in shape:
            return self.coefficients
        products = [Coefficient(f"{a}f{b}", "N m") for a in "xyz" for b in "xyz"]
        return (*self.coefficients[:3], *products)

    def can_have(self, coefficients: Array, shape: Mapping[str, Any], signals: Signals) -> bool:
        # A weight on a point that turns with the tool is a payload.
        return "arm" not in shape or not _is_vertical(coefficients[:3], signals)

    def usually(
        self,
        coefficients: Array,
        shape: Mapping[str, Any],
        signals: Signals,
        joints: Sequence[int],
    ) -> str | None:
        assert signals.robot is not None
        if "on_tool" in shape or not _is_vertical(coefficients[:3], signals):
            return None
        return "payload" if coefficients[:3] @ signals.robot.gravity > 0 else None

    def parameters(
        self, coefficients: Array, shape: Mapping[str, Any], signals: Signals | None = None
    ) -> dict[str, Any]:
        if "arm" in shape:
            force, products = coefficients[:3], np.reshape(coefficients[3:], (3, 3))
            arm = products @ force / max(float(force @ force), np.finfo(float).tiny)
            names = [f"{what}_{axis}" for what in ("force", "arm") for axis in "xyz"]
            return dict(zip(names, map(float, (*force, *arm)), strict=True))
        frame = "tool_" if "on_tool" in shape else ""
        names = [f"{frame}{what}_{axis}" for what in ("force", "moment") for axis in "xyz"]
        values: dict[str, Any] = dict(zip(names, map(float, coefficients), strict=True))
        return values | {"point": shape["point"]} if "point" in shape else values

    def meaning(self, parameters: Mapping[str, Mapping[str, Any]]) -> str:
        if "tool_force_x" not in parameters:
            return _at_point(parameters)
        return "The force turns with the tool: its components are along the axes of the last link."

    def units(self, prismatic: bool = False) -> dict[str, str]:
        frames = ("", "tool_")
        force = {f"{frame}force_{a}": "N" for frame in frames for a in "xyz"}
        force |= {f"arm_{a}": "m" for a in "xyz"}
        return force | {f"{frame}moment_{a}": "N m" for frame in frames for a in "xyz"}


def _is_vertical(force: Array, signals: Signals) -> bool:
    """Whether a force in the frame of the base is along gravity, as a weight is."""
    assert signals.robot is not None
    size = float(np.linalg.norm(signals.robot.gravity))
    if size == 0:
        return False
    down = signals.robot.gravity / size
    aside = np.linalg.norm(force - (force @ down) * down)
    return bool(aside <= LEAST_ASIDE * np.linalg.norm(force))


#: Power of the depth with which the force between round bodies grows (Hertz 1882).
_HERTZ = 1.5
#: Shape entries of a ball.
_BALL = ("radius", "center_x", "center_y", "center_z")
#: Number of places at which a ball is tried, their spread in standard deviations of the motion, and
#: the share of the motion that its surface leaves inside.
_PLACES, _SPREAD, _INSIDE = 20, 1.3, 0.22
#: Directions (azimuth and elevation in rad) of planes that are tried in addition to the axes: walls
#: and tilted tables. From them a direction is refined, which that of an axis is not.
_OBLIQUE = (
    *((np.pi * k / 4, 0.0) for k in range(8)),
    *((np.pi * k / 2, np.pi / 3) for k in range(4)),
)


class EnvironmentContact(Effect):
    """A soft surface that the tool presses into.

    It is a plane, whose normal is an axis of the base, or has the direction ``azimuth`` and
    ``elevation``; then the plane is at ``z0`` relative to the point ``x``, ``y``, ``z``. Or it is a
    ball of a ``radius`` about ``center_x``, ``center_y``, ``center_z``. A contact of round bodies
    stiffens: then the force grows with another ``power`` of the depth (1 if the shape has none), in
    units of 1 m, so that the unit of the stiffness is the same. A contact that loses energy has a
    larger force during approach, by the factor ``1 + damping`` times the speed of the approach
    (Hunt, Crossley 1975, J. Applied Mechanics 42(2)), and never pulls. The tool is the origin of
    the last body, or with ``point`` the link of this name that is fixed to it.
    """

    kind = "environment_contact"
    title = "Contact with the environment"
    formula = (
        r"-J_n(q)^\top n\,k\,x^p\,\max(0,\ 1 + d\,\dot x),"
        r"\quad x = \max(0,\ z_0 - n^\top p(q)) \text{ or } \max(0,\ r - |p(q) - c|)"
    )
    coefficients = (Coefficient("k", "N/m", sign=1),)
    shapes = (
        Shape("z0", "m", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("azimuth", "rad", (), -np.inf, np.inf, spacing="linear", scales=False),
        Shape("elevation", "rad", (), -np.pi / 2, np.pi / 2, spacing="linear", scales=False),
        Shape("damping", "s/m", (), 1e-2, 1e3, scales=False, has_interval=False),
        Shape("radius", "m", (), 1e-3, 1e2, scales=False),
        *(
            Shape(f"center_{a}", "m", (), -np.inf, np.inf, spacing="linear", scales=False)
            for a in "xyz"
        ),
    )
    forms = (
        *({"azimuth": a, "elevation": e} for a, e in _OBLIQUE),
        dict.fromkeys(_BALL, 0.0),
        {"power": _HERTZ},
        {"damping": 2.0},
    )
    scope = "robot"
    needs = ("robot",)
    simplicity = 26
    rivals = ("external_wrench", "end_stop")
    separating_motion = "the same path away from the surface"
    reference = "Khatib (1987), IEEE JRA 3(1), 43-53."

    def grid(self, signals: Signals, joints: Sequence[int]) -> list[dict[str, Any]]:
        return [
            shape | point
            for point in points_of_tool(signals)
            for shape in self._grid_of(tool_position(signals, point))
        ]

    def _grid_of(self, position: Array) -> list[dict[str, Any]]:
        """Surfaces for positions of the tool."""
        along_axes = [
            {
                "z0": float(side * np.quantile(side * position[:, axis], share)),
                "side": side,
                "axis": axis,
            }
            for axis in range(3)
            for side in (1.0, -1.0)
            for share in (0.05, 0.1, 0.15, 0.2, 0.3)
        ]
        oblique = []
        *planes, _, stiffening, damped = map(dict, self.forms)
        for form in planes:
            height = position @ _normal(form)
            for share in (0.06, 0.12, 0.25):
                edge = np.quantile(height, share)
                place = position[height <= edge].mean(axis=0)
                at = dict(zip("xyz", map(float, place), strict=True))
                oblique.append({"z0": float(edge - place @ _normal(form))} | form | at)
        plain = along_axes + oblique
        further = [shape | form for form in (stiffening, damped) for shape in plain[1::3]]
        return plain + further + self._balls(position)

    @staticmethod
    def _balls(position: Array) -> list[dict[str, Any]]:
        """Balls about places within and around the motion, each with some of it inside."""
        from scipy.special import ndtri
        from scipy.stats import qmc

        places = ndtri(qmc.Halton(3, scramble=False).random(_PLACES + 1)[1:])
        balls = []
        for center in position.mean(axis=0) + _SPREAD * position.std(axis=0) * places:
            radius = np.quantile(np.linalg.norm(position - center, axis=1), _INSIDE)
            balls.append(dict(zip(_BALL, map(float, (radius, *center)), strict=True)))
        return balls

    def meaning(self, parameters: Mapping[str, Mapping[str, Any]]) -> str:
        told = _at_point(parameters)
        if "radius" in parameters:
            told = f"The surface is a ball. {told}".rstrip()
        if "axis" in parameters:
            sign = "−" if parameters["side"]["value"] < 0 else "+"
            axis = "xyz"[int(parameters["axis"]["value"])]
            told = f"The surface faces the {sign}{axis} direction of the base. {told}".rstrip()
        return told

    def admissible(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> bool:
        _, height = _surface(signals, shape)
        return bool(FEWEST_TOUCHING < np.mean(height < 0) < MOST_TOUCHING)

    def travel(self, signals: Signals, joints: Sequence[int], shape: Mapping[str, Any]) -> float:
        return float(np.ptp(_surface(signals, shape)[1]))

    def torque_columns(
        self, signals: Signals, joints: Sequence[int], **shape: Any
    ) -> dict[int, Array]:
        normal, height = _surface(signals, shape)
        reach = np.einsum("ian,ia->in", tool_jacobian(signals, shape), normal)
        pressure = np.maximum(0.0, -height) ** shape.get("power", 1.0)
        if "damping" in shape:
            approach = -np.sum(reach * signals.dq, axis=1)
            pressure = pressure * np.maximum(0.0, 1.0 + shape["damping"] * approach)
        pressed = -pressure[:, None] * reach
        return {j: pressed[:, [j]] for j in joints}


def _at_point(parameters: Mapping[str, Mapping[str, Any]]) -> str:
    """At which point of the last body a force acts, if not at its origin; as a sentence."""
    name = parameters.get("point", {}).get("value")
    return f"It acts at the origin of link {name!r}." if name else ""


def _normal(shape: Mapping[str, Any]) -> Array:
    """Normal of a plane, pointing out of it, shape (3,)."""
    if "azimuth" not in shape:
        return np.asarray(float(shape["side"]) * np.eye(3)[int(shape["axis"])])
    a, e = shape["azimuth"], shape["elevation"]
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def _surface(signals: Signals, shape: Mapping[str, Any]) -> tuple[Array, Array]:
    """Surface that the tool may touch.

    Parameters
    ----------
    signals : Signals
        Motion and robot.
    shape : mapping
        Shape of the contact, of a plane or a ball.

    Returns
    -------
    normal : ndarray of shape (n_samples, 3)
        Direction out of the surface at the tool, of unit length.
    height : ndarray of shape (n_samples,), m
        Distance of the tool from the surface, negative inside.
    """
    position = tool_position(signals, shape)
    if "radius" in shape:
        away = position - np.array([shape[name] for name in _BALL[1:]])
        distance = np.sqrt(np.einsum("ia,ia->i", away, away))
        normal = away / np.maximum(distance, np.finfo(float).tiny)[:, None]
        return normal, distance - shape["radius"]
    normal = _normal(shape)
    if "azimuth" in shape:
        height = (position - np.array([shape[axis] for axis in "xyz"])) @ normal - shape["z0"]
    else:
        height = position @ normal - shape["side"] * shape["z0"]
    return np.broadcast_to(normal, position.shape), height
