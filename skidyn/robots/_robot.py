# SPDX-License-Identifier: BSD-3-Clause
"""A robot described in URDF, SDF or MJCF."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from skidyn._exceptions import RobotDescriptionError
from skidyn.dynamics import KinematicTree
from skidyn.robots._assembly import LinkPlacement, assemble
from skidyn.robots._chain import build_chain, describe_chain, links_of
from skidyn.robots._description import Description
from skidyn.robots._dynamics import PARAMETER_SYMBOLS, RigidBodyDynamics
from skidyn.robots._mjcf import parse_mjcf
from skidyn.robots._sdf import parse_sdf
from skidyn.robots._urdf import parse_urdf
from skidyn.robots._xml import (
    first_element,
    name_of,
    naming_file,
    parse_robot_element,
    read_description,
)

#: Permitted difference between frames of a chain and its description, m, because of float32.
_SINGLE_PRECISION = 1e-5

if TYPE_CHECKING:
    import torch
    from pytorch_kinematics.chain import Chain

    from skidyn.robots._torch import TorchDynamics


@dataclass(frozen=True, eq=False, repr=False)
class Robot(RigidBodyDynamics):
    """A robot arm or tree: joints, limits, inertial parameters and rigid-body dynamics.

    Created by :meth:`from_urdf`, :meth:`from_sdf`, :meth:`from_mjcf` or :meth:`from_chain`. A robot
    is immutable; it can be pickled and shared between threads.

    Links that are fixed to each other are one body; its frame is that of the link whose joint moves
    it. All methods take joint positions ``q`` (rad, m), velocities ``dq`` and accelerations ``ddq``
    of shape (n_samples, n_joints) and are batched over the samples.

    Parameters
    ----------
    name : str
        Name in the URDF.
    joint_names : tuple of str
        Independent joints, depth first in the order of the file.
    joint_types : tuple of str
        ``"revolute"``, ``"continuous"`` or ``"prismatic"``.
    body_names : tuple of str
        Moving bodies, parents first; one per joint and one more per joint that mimics another.
    body_joints : tuple of str
        Name of the joint that moves each body.
    position_limits : ndarray of shape (n_joints, 2)
        Lower and upper, rad or m; infinite for continuous joints.
    velocity_limits : ndarray of shape (n_joints,)
        rad/s or m/s.
    effort_limits : ndarray of shape (n_joints,)
        N m or N.
    joint_dynamics : dict of str to ndarray of shape (n_joints,)
        ``"damping"`` (N m s/rad or N s/m) and ``"friction"`` (N m or N) of the URDF; no method uses
        them.
    gravity : ndarray of shape (3,)
        Gravitational acceleration in the base frame, m/s^2.
    inertial_parameters : ndarray of shape (n_bodies, 10)
        ``(m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz)`` in the frame of the body and about
        its origin; kg, kg m, kg m^2.
    tree : KinematicTree
        Placement and axis of every body, for the recursions.
    links : dict of str to LinkPlacement
        All links of the URDF: the body that carries them (-1: the base) and their pose in it.

    References
    ----------
    .. [1] R. Featherstone, "Rigid Body Dynamics Algorithms", Springer, 2008.
    .. [2] C. G. Atkeson, C. H. An, J. M. Hollerbach, "Estimation of inertial parameters of
           manipulator loads and links", Int. Journal of Robotics Research 5(3), 1986.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> robot = load_planar_arm()
    >>> robot.joint_names
    ('joint1', 'joint2')
    >>> robot.inverse_dynamics([[0.0, 0.0]], [[0.0, 0.0]], [[0.0, 0.0]]).shape
    (1, 2)
    """

    name: str
    joint_names: tuple[str, ...]
    joint_types: tuple[str, ...]
    body_names: tuple[str, ...]
    body_joints: tuple[str, ...]
    position_limits: np.ndarray
    velocity_limits: np.ndarray
    effort_limits: np.ndarray
    joint_dynamics: dict[str, np.ndarray]
    gravity: np.ndarray
    inertial_parameters: np.ndarray
    tree: KinematicTree
    links: dict[str, LinkPlacement]

    @classmethod
    def from_file(
        cls,
        source: str | bytes | os.PathLike[str],
        *,
        joints: Sequence[str] | None = None,
        gravity: Sequence[float] | None = None,
    ) -> Robot:
        """Read a robot from a URDF, an SDF or an MJCF, depending on its first element.

        Parameters
        ----------
        source : str, bytes or path
            Path of the file, or the text itself (anything that starts with ``<``).
        joints : sequence of str, default=None
            Joints that the logs cover, as in :meth:`from_urdf`.
        gravity : sequence of 3 floats, default=None
            Gravitational acceleration in the base frame, m/s^2. None: (0, 0, -9.81), or that of an
            MJCF.

        Returns
        -------
        Robot

        Raises
        ------
        RobotDescriptionError
            As :meth:`from_urdf`, :meth:`from_sdf` and :meth:`from_mjcf`.

        Examples
        --------
        >>> from skidyn.robots import Robot
        >>> robot = Robot.from_file('''
        ...   <robot name="slider"><link name="base"/>
        ...     <link name="tool"><inertial>
        ...       <mass value="2"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>
        ...     </inertial></link>
        ...     <joint name="up" type="prismatic">
        ...       <parent link="base"/><child link="tool"/><axis xyz="0 0 1"/>
        ...       <limit lower="0" upper="1" effort="9" velocity="1"/>
        ...     </joint>
        ...   </robot>''')
        >>> robot.gravity_torque([[0.5]])
        array([[19.62]])
        """
        with naming_file(source):
            description, own = _read(source)
            return cls._from_description(description, joints, own if gravity is None else gravity)

    @classmethod
    def from_urdf(
        cls,
        source: str | bytes | os.PathLike[str],
        *,
        joints: Sequence[str] | None = None,
        gravity: Sequence[float] = (0.0, 0.0, -9.81),
    ) -> Robot:
        """Read a robot from a URDF.

        Revolute, continuous, prismatic, fixed and mimic joints in any tree. A missing ``<axis>`` is
        x, a missing ``<inertial>`` is no mass, as defined by the URDF standard. Angles are taken as
        written: 1.5708 stays 1.5708.

        Parameters
        ----------
        source : str, bytes or path
            Path of the file, or the text itself (anything that starts with ``<``).
        joints : sequence of str, default=None
            Joints in the logs; the others are locked at zero and their bodies become part of their
            parent bodies. None means all. The order is always that of the URDF.
        gravity : sequence of 3 floats, default=(0, 0, -9.81)
            Gravitational acceleration in the base frame, m/s^2.

        Returns
        -------
        Robot

        Raises
        ------
        RobotDescriptionError
            The description cannot be modelled; the message names the link or joint and the required
            change.

        Examples
        --------
        >>> from skidyn.robots import Robot
        >>> robot = Robot.from_urdf('''
        ...   <robot name="pendulum"><link name="base"/>
        ...     <link name="rod"><inertial>
        ...       <origin xyz="0 0 -0.5"/><mass value="2"/>
        ...       <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/>
        ...     </inertial></link>
        ...     <joint name="swing" type="continuous">
        ...       <parent link="base"/><child link="rod"/>
        ...     </joint>
        ...   </robot>''')
        >>> robot.gravity_torque([[1.5707963267948966]]).round(2)
        array([[9.81]])
        """
        with naming_file(source):
            element = parse_robot_element(read_description(source), name_of(source))
            return cls._from_description(parse_urdf(element), joints, gravity)

    @classmethod
    def from_sdf(
        cls,
        source: str | bytes | os.PathLike[str],
        *,
        model: str | None = None,
        joints: Sequence[str] | None = None,
        gravity: Sequence[float] = (0.0, 0.0, -9.81),
    ) -> Robot:
        """Read a robot from an SDF, the format of Gazebo.

        Revolute, continuous, prismatic and fixed joints of one model without nested models. Poses
        may be relative to links, joints and frames. A link without ``<inertial>`` has 1 kg and 1 kg
        m^2, as defined by the SDF standard, with a warning. The base frame is that of the model.

        Parameters
        ----------
        source : str, bytes or path
            Path of the file, or the text itself (anything that starts with ``<``).
        model : str, default=None
            Name of the model; needed where the file has several.
        joints : sequence of str, default=None
            Joints that the logs cover, as in :meth:`from_urdf`.
        gravity : sequence of 3 floats, default=(0, 0, -9.81)
            Gravitational acceleration in the frame of the model, m/s^2.

        Returns
        -------
        Robot

        Raises
        ------
        RobotDescriptionError
            The description cannot be modelled; the message names the link or joint and the required
            change.

        Examples
        --------
        >>> from skidyn.robots import Robot
        >>> robot = Robot.from_sdf('''
        ...   <sdf version="1.9"><model name="pendulum">
        ...     <link name="rod"><pose>0 0 1 0 0 0</pose><inertial>
        ...       <pose>0 0 -0.5 0 0 0</pose><mass>2</mass>
        ...       <inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.01</izz></inertia>
        ...     </inertial></link>
        ...     <joint name="swing" type="revolute">
        ...       <parent>world</parent><child>rod</child><axis><xyz>1 0 0</xyz></axis>
        ...     </joint>
        ...   </model></sdf>''')
        >>> robot.gravity_torque([[1.5707963267948966]]).round(2)
        array([[9.81]])
        """
        with naming_file(source):
            description = parse_sdf(read_description(source), model)
            return cls._from_description(description, joints, gravity)

    @classmethod
    def from_mjcf(
        cls,
        source: str | bytes | os.PathLike[str],
        *,
        joints: Sequence[str] | None = None,
        gravity: Sequence[float] | None = None,
    ) -> Robot:
        """Read a robot from an MJCF, the format of MuJoCo; needs the extra ``mujoco``.

        MuJoCo compiles the model, with all its defaults; hinges and slides, also several on a body,
        are read with their reference positions. Ratios between joints are read as mimic joints.
        Armature and springs are not part of the rigid body and are left out with a warning. Sites
        are links.

        Parameters
        ----------
        source : str, bytes or path
            Path of the file, or the text itself (anything that starts with ``<``).
        joints : sequence of str, default=None
            Joints that the logs cover, as in :meth:`from_urdf`.
        gravity : sequence of 3 floats, default=None
            Gravitational acceleration in the frame of the world, m/s^2; that of the file if None.

        Returns
        -------
        Robot

        Raises
        ------
        RobotDescriptionError
            The description cannot be modelled; the message names the joint and the required change.
        ImportError
            MuJoCo is not installed.

        Examples
        --------
        >>> from skidyn.robots import Robot
        >>> robot = Robot.from_mjcf('''
        ...   <mujoco model="pendulum"><worldbody><body name="rod">
        ...     <joint name="swing" axis="1 0 0"/>
        ...     <inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.01"/>
        ...   </body></worldbody></mujoco>''')
        >>> robot.gravity_torque([[1.5707963267948966]]).round(2)
        array([[9.81]])
        """
        with naming_file(source):
            description, own = parse_mjcf(source)
            return cls._from_description(description, joints, own if gravity is None else gravity)

    @classmethod
    def from_chain(
        cls,
        chain: Chain,
        inertials: str | bytes | os.PathLike[str] | Mapping[str, Any],
        *,
        joints: Sequence[str] | None = None,
        gravity: Sequence[float] | None = None,
    ) -> Robot:
        """Create a robot from a chain of pytorch-kinematics, with its frames and joints.

        A chain has no inertia, which is therefore read separately. The robot computes in float64:
        offsets are as accurate as those of the chain, which the parsers of pytorch-kinematics
        convert through float32 (1e-8 to 3e-7 m on the bundled robots), with the nearest rotation
        instead of a rounded one. :attr:`chain` is the chain with these numbers.

        Parameters
        ----------
        chain : pytorch_kinematics.Chain
            Chain of any precision, on any device. It is not changed.
        inertials : str, bytes, path or mapping of str to array-like of shape (10,)
            The URDF, SDF or MJCF that the chain was built from; limits and mimic joints are read
            from it, too. Or the inertial parameters of its links, in the frames of the chain (m, m
            cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz; kg, kg m, kg m^2); other links have no
            mass.
        joints : sequence of str, default=None
            Joints that the logs cover, as in :meth:`from_urdf`.
        gravity : sequence of 3 floats, default=None
            Gravitational acceleration in the base frame, m/s^2. None: (0, 0, -9.81), or that of an
            MJCF.

        Returns
        -------
        Robot

        Raises
        ------
        RobotDescriptionError
            A frame of the chain differs from the description (parsers of pytorch-kinematics 0.10
            take z for a missing axis in a URDF and turn poses of an SDF in another order), or a
            link that has a mass is not in the chain.

        Examples
        --------
        >>> from pytorch_kinematics import build_chain_from_urdf
        >>> from skidyn.robots import Robot
        >>> urdf = '''
        ...   <robot name="pendulum"><link name="base"/>
        ...     <link name="rod"><inertial>
        ...       <origin xyz="0 0 -0.5"/><mass value="2"/>
        ...       <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/>
        ...     </inertial></link>
        ...     <joint name="swing" type="continuous">
        ...       <parent link="base"/><child link="rod"/><axis xyz="1 0 0"/>
        ...     </joint>
        ...   </robot>'''
        >>> robot = Robot.from_chain(build_chain_from_urdf(urdf), urdf)
        >>> robot.gravity_torque([[1.5707963267948966]]).round(2)
        array([[9.81]])
        """
        if isinstance(inertials, Mapping):
            description = describe_chain(chain, links_of(inertials), {})
            given = (0.0, 0.0, -9.81) if gravity is None else gravity
            return cls._from_description(description, joints, given)
        written, own = _read(inertials)
        given = own if gravity is None else gravity
        robot = cls._from_description(
            describe_chain(chain, written.links, written.joints), joints, given
        )
        _refuse_displaced(robot, cls._from_description(written, joints, given))
        return replace(robot, name=written.name)

    @classmethod
    def _from_description(
        cls, description: Description, joints: Sequence[str] | None, gravity: Any
    ) -> Robot:
        assembly = assemble(description, joints)
        own = assembly.joints
        return cls(
            name=description.name,
            joint_names=tuple(joint.name for joint in own),
            joint_types=tuple(joint.kind for joint in own),
            body_names=tuple(assembly.body_names),
            body_joints=tuple(joint.name for joint in assembly.moved_by),
            position_limits=_frozen([joint.position_limits for joint in own]),
            velocity_limits=_frozen([joint.velocity_limit for joint in own]),
            effort_limits=_frozen([joint.effort_limit for joint in own]),
            joint_dynamics={
                "damping": _frozen([joint.damping for joint in own]),
                "friction": _frozen([joint.friction for joint in own]),
            },
            gravity=_gravity(gravity),
            inertial_parameters=_frozen(assembly.parameters),
            tree=assembly.tree(),
            links=assembly.links,
        )

    def with_gravity(self, gravity: Sequence[float] | Literal["none"]) -> Robot:
        """The same robot with another gravity, as of one that is mounted on a wall.

        Parameters
        ----------
        gravity : sequence of 3 floats, m/s^2, or "none"
            Gravity in the base frame; ``"none"`` for a log of torque from which it was removed.

        Returns
        -------
        Robot
            A copy; this robot is not changed.

        Raises
        ------
        RobotDescriptionError
            It is neither ``"none"`` nor three finite numbers that are not all zero.

        Examples
        --------
        >>> from skidyn.datasets import load_planar_arm
        >>> load_planar_arm().with_gravity([0, -9.81, 0]).gravity
        array([ 0.  , -9.81,  0.  ])
        """
        none = isinstance(gravity, str) and gravity == "none"
        turned = _frozen(np.zeros(3)) if isinstance(gravity, str) else _gravity(gravity)
        if not (none or turned.any()):
            raise RobotDescriptionError(
                f"gravity is {gravity!r}; expected three numbers in m/s^2 that are not all zero, "
                "such as (0, -9.81, 0), or 'none' for torque from which gravity was removed."
            )
        return replace(self, gravity=turned)

    @property
    def chain(self) -> Chain:
        """Chain of pytorch-kinematics: batched, differentiable kinematics, float64, on the CPU.

        A new chain at every access, because ``chain.to(dtype=..., device=...)`` changes it. Its
        joints are :attr:`body_joints` in their order; where no joint mimics another, its positions
        are ``q``. ``SerialChain(robot.chain, link, dtype=torch.float64)`` gives the Jacobian of a
        link.

        Examples
        --------
        >>> import torch
        >>> from skidyn.datasets import load_planar_arm
        >>> robot = load_planar_arm()
        >>> pose = robot.chain.forward_kinematics(torch.zeros(5, 2, dtype=torch.float64))
        >>> pose[robot.body_names[-1]].get_matrix().shape
        torch.Size([5, 4, 4])
        """
        return build_chain(self)

    @property
    def parents(self) -> np.ndarray:
        """Parent body of every body, shape (n_bodies,); -1 is the fixed base."""
        return self.tree.parents

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Names such as ``"Ixx_link1"`` of the flattened inertial parameters, 10 per body."""
        return tuple(f"{symbol}_{body}" for body in self.body_names for symbol in PARAMETER_SYMBOLS)

    @cached_property
    def _torch(self) -> TorchDynamics:
        from skidyn.robots._torch import TorchDynamics

        return TorchDynamics(self)

    def __getstate__(self) -> dict[str, Any]:
        # Without the cached engine, the pickle (and its hash) does not depend on earlier calls.
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in (*state.values(), *state["joint_dynamics"].values()):
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        self.__dict__.update(state)

    def __deepcopy__(self, memo: dict[int, Any]) -> Robot:
        return self  # immutable: scikit-learn's clone shares it, with all traced programs

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, n_joints={self.n_joints})"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{kind}</td><td>{low:.4g} .. {high:.4g}</td></tr>"
            for name, kind, (low, high) in zip(
                self.joint_names, self.joint_types, self.position_limits, strict=True
            )
        )
        head = "<tr><th>joint</th><th>type</th><th>limits (rad, m)</th></tr>"
        return f"<b>{escape(self.name)}</b><table>{head}{rows}</table>"

    def inverse_dynamics_torch(
        self, q: torch.Tensor, dq: torch.Tensor, ddq: torch.Tensor, parameters: Any = None
    ) -> torch.Tensor:
        """Differentiable :meth:`inverse_dynamics`, in the precision and on the device of ``q``.

        Its transforms are those of :attr:`chain`.

        Parameters
        ----------
        q, dq, ddq : Tensor of shape (n_samples, n_joints)
            Positions (rad, m), velocities and accelerations.
        parameters : Tensor of shape (n_bodies, 10), default=None
            Inertial parameters instead of those of the URDF; may require gradients.

        Returns
        -------
        Tensor of shape (n_samples, n_joints)
            N m; N for prismatic joints.
        """
        return self._torch.inverse_dynamics(q, dq, ddq, parameters)

    def torque_regressor_torch(
        self, q: torch.Tensor, dq: torch.Tensor, ddq: torch.Tensor
    ) -> torch.Tensor:
        """Differentiable :meth:`torque_regressor`, in the precision and on the device of ``q``.

        Its transforms are those of :attr:`chain`.

        Parameters
        ----------
        q, dq, ddq : Tensor of shape (n_samples, n_joints)
            Positions (rad, m), velocities and accelerations.

        Returns
        -------
        Tensor of shape (n_samples, n_joints, 10 * n_bodies)
            Joint torque per unit of every inertial parameter.
        """
        return self._torch.torque_regressor(q, dq, ddq)


def _read(source: str | bytes | os.PathLike[str]) -> tuple[Description, Any]:
    """Description of a robot, and its gravity or the default."""
    data = read_description(source)
    kind = first_element(data)
    if kind == "mujoco":
        return parse_mjcf(source)
    usual = (0.0, 0.0, -9.81)
    if kind == "sdf":
        return parse_sdf(data, None), usual
    return parse_urdf(parse_robot_element(data, name_of(source))), usual


def _refuse_displaced(robot: Robot, described: Robot) -> None:
    """Raise an error if a frame of a chain differs from its description."""
    if robot.joint_names != described.joint_names:
        raise RobotDescriptionError(
            f"The chain has the joints {list(robot.joint_names)}, the description "
            f"{list(described.joint_names)}; was the chain built from it?"
        )
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (5, robot.n_joints))
    for name, link in robot.links.items():
        if name not in described.links:
            continue
        poses = [one.forward_kinematics(q, name) for one in (robot, described) if link.body >= 0]
        poses += [
            (one.links[name].translation, one.links[name].rotation)
            for one in (robot, described)
            if link.body < 0
        ]
        (place, turn), (its_place, its_turn) = poses
        away, turned = np.abs(place - its_place).max(), np.abs(turn - its_turn).max()
        if not max(away, turned) < _SINGLE_PRECISION:
            raise RobotDescriptionError(
                f"The frame {name!r} of the chain is up to {away:.2g} m away from where its "
                f"description has it, and turned by {turned:.2g}. Parsers of pytorch-kinematics "
                "take z for a missing <axis> (URDF), turn poses in another order (SDF) and move "
                "bodies to the anchors of their joints (MJCF). Use Robot.from_file, or give the "
                "inertia of the links in the frames of the chain, as a mapping."
            )


def _frozen(values: Any) -> np.ndarray:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def _gravity(gravity: Sequence[float]) -> np.ndarray:
    array = _frozen(gravity)
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        raise RobotDescriptionError(
            f"gravity is {gravity}; expected three finite numbers in m/s^2, such as (0, 0, -9.81)."
        )
    return array
