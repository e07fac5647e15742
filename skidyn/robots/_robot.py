# SPDX-License-Identifier: BSD-3-Clause
"""The robot: what its URDF says, and its rigid-body dynamics."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._exceptions import RobotDescriptionError, SkidynError
from skidyn.dynamics import Engine, KinematicTree
from skidyn.robots._assembly import LinkPlacement, assemble
from skidyn.robots._chain import build_chain
from skidyn.robots._description import Description
from skidyn.robots._mjcf import parse_mjcf
from skidyn.robots._sdf import parse_sdf
from skidyn.robots._urdf import parse_urdf
from skidyn.robots._xml import first_element, parse_robot_element, read_description

if TYPE_CHECKING:
    import torch
    from pytorch_kinematics.chain import Chain

    from skidyn.robots._torch import TorchDynamics

_PARAMETER_SYMBOLS = ("m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")


@dataclass(frozen=True, eq=False, repr=False)
class Robot:
    """A robot arm or tree: joints, limits, inertial parameters and rigid-body dynamics.

    Made by :meth:`from_urdf`, :meth:`from_sdf` or :meth:`from_mjcf`. A robot never changes; it can
    be pickled and shared between threads.

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
        """Read a robot from a URDF, an SDF or an MJCF, whichever its first element says.

        Parameters
        ----------
        source : str, bytes or path
            Path of the file, or the text itself (anything that starts with ``<``).
        joints : sequence of str, default=None
            Joints that the logs cover, as in :meth:`from_urdf`.
        gravity : sequence of 3 floats, default=None
            Gravitational acceleration in the base frame, m/s^2. None: (0, 0, -9.81), or what an
            MJCF says.

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
        given: dict[str, Any] = {} if gravity is None else {"gravity": gravity}
        kind = first_element(read_description(source))
        read: Any = {"sdf": cls.from_sdf, "mujoco": cls.from_mjcf}.get(kind, cls.from_urdf)
        robot: Robot = read(source, joints=joints, **given)
        return robot

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
        x, a missing ``<inertial>`` is no mass, as the URDF standard says. Angles are taken as
        written: 1.5708 stays 1.5708.

        Parameters
        ----------
        source : str, bytes or path
            Path of the file, or the text itself (anything that starts with ``<``).
        joints : sequence of str, default=None
            Joints that the logs cover; the others are locked at zero and their bodies become part
            of what carries them. None means all. The order is always that of the URDF.
        gravity : sequence of 3 floats, default=(0, 0, -9.81)
            Gravitational acceleration in the base frame, m/s^2.

        Returns
        -------
        Robot

        Raises
        ------
        RobotDescriptionError
            The description is not a robot that can be modelled; the message names the link or joint
            and says what to change.

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
        description = parse_urdf(parse_robot_element(read_description(source)))
        return cls._from_description(description, joints, gravity)

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
        m^2, as the SDF standard says; a warning names it. The base frame is that of the model.

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
            The description is not a robot that can be modelled; the message names the link or joint
            and says what to change.

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
        return cls._from_description(parse_sdf(read_description(source), model), joints, gravity)

    @classmethod
    def from_mjcf(
        cls,
        source: str | bytes | os.PathLike[str],
        *,
        joints: Sequence[str] | None = None,
        gravity: Sequence[float] | None = None,
    ) -> Robot:
        """Read a robot from an MJCF, the format of MuJoCo; needs the extra ``mujoco``.

        MuJoCo compiles the model, with all its defaults; hinges and slides, several on a body too,
        with their reference positions. Ratios between joints are read as mimic joints. Armature
        and springs are no rigid bodies: they are left out with a warning. Sites are links.

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
            The description is not a robot that can be modelled; the message names the joint and
            says what to change.
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
        description, own = parse_mjcf(source)
        return cls._from_description(description, joints, own if gravity is None else gravity)

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

    @property
    def chain(self) -> Chain:
        """Chain of pytorch-kinematics: batched, differentiable kinematics, float64, on the CPU.

        A new one at every access, because ``chain.to(dtype=..., device=...)`` changes it. Its
        joints are :attr:`body_joints` in their order; where no joint mimics another, its positions
        are ``q``. ``SerialChain(robot.chain, link)`` gives the Jacobian of a link.

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
    def n_joints(self) -> int:
        """Number of independent joints."""
        return len(self.joint_names)

    @property
    def n_bodies(self) -> int:
        """Number of moving bodies."""
        return len(self.body_names)

    @property
    def parents(self) -> np.ndarray:
        """Parent body of every body, shape (n_bodies,); -1 is the fixed base."""
        return self.tree.parents

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Names such as ``"Ixx_link1"`` of the flattened inertial parameters, 10 per body."""
        return tuple(
            f"{symbol}_{body}" for body in self.body_names for symbol in _PARAMETER_SYMBOLS
        )

    @cached_property
    def _engine(self) -> Engine:
        return Engine(self.tree, self.inertial_parameters, self.gravity)

    @cached_property
    def _torch(self) -> TorchDynamics:
        from skidyn.robots._torch import TorchDynamics

        return TorchDynamics(self)

    def __getstate__(self) -> dict[str, Any]:
        # Without the cached engine: the pickle (and so its hash) does not depend on past calls.
        return {name: self.__dict__[name] for name in self.__dataclass_fields__}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in (*state.values(), *state["joint_dynamics"].values()):
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
        self.__dict__.update(state)

    def __deepcopy__(self, memo: dict[int, Any]) -> Robot:
        return self  # immutable: scikit-learn's clone shares it, with all that was traced

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

    def inverse_dynamics(
        self,
        q: Any,
        dq: Any,
        ddq: Any,
        *,
        parameters: Any = None,
        gravity: Sequence[float] | None = None,
        dtype: Any = np.float64,
        backend: str = "numpy",
    ) -> np.ndarray:
        """Joint torques of a motion, without friction.

        Parameters
        ----------
        q, dq, ddq : array-like of shape (n_samples, n_joints)
            Positions (rad, m), velocities and accelerations.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.
        gravity : sequence of 3 floats, default=None
            Gravitational acceleration in the base frame in place of the robot's, m/s^2.
        dtype : {numpy.float64, numpy.float32}, default=numpy.float64
            float32 is about twice as fast; its error stays below 2e-6 of the largest torque.
        backend : {"numpy", "compiled"}, default="numpy"
            ``"compiled"`` writes C text for this robot, compiles it once with the system's C
            compiler (about a second) and is then several times as fast; float64 only.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            N m; N for prismatic joints.

        Raises
        ------
        SkidynError
            Signals or parameters have the wrong shape, or there is no C compiler.

        Examples
        --------
        >>> from skidyn.datasets import load_scara
        >>> load_scara().inverse_dynamics([[0, 0, 0, 0]], [[0, 0, 0, 0]], [[0, 0, 1, 0]]).round(2)
        array([[ 0.  ,  0.  , 16.22,  0.  ]])
        """
        _check_backend(backend, dtype)
        signals = self._signals(q=q, dq=dq, ddq=ddq)
        return self._engine.inverse_dynamics(
            signals,
            gravity,
            parameters=self._parameters(parameters),
            dtype=dtype,
            backend=backend,
        )

    def gravity_torque(
        self, q: Any, *, parameters: Any = None, gravity: Sequence[float] | None = None
    ) -> np.ndarray:
        """Joint torques that hold the robot at rest.

        Parameters
        ----------
        q : array-like of shape (n_samples, n_joints)
            Positions, rad or m.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.
        gravity : sequence of 3 floats, default=None
            Gravitational acceleration in the base frame in place of the robot's, m/s^2.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            N m; N for prismatic joints.
        """
        return self._engine.inverse_dynamics(
            self._signals(q=q), gravity, parameters=self._parameters(parameters)
        )

    def coriolis_torque(self, q: Any, dq: Any, *, parameters: Any = None) -> np.ndarray:
        """Centrifugal and Coriolis torques.

        Parameters
        ----------
        q, dq : array-like of shape (n_samples, n_joints)
            Positions (rad, m) and velocities.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            N m; N for prismatic joints.
        """
        return self._engine.inverse_dynamics(
            self._signals(q=q, dq=dq), (0.0, 0.0, 0.0), parameters=self._parameters(parameters)
        )

    def mass_matrix(self, q: Any, *, parameters: Any = None) -> np.ndarray:
        """Joint-space inertia matrix.

        Parameters
        ----------
        q : array-like of shape (n_samples, n_joints)
            Positions, rad or m.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.

        Returns
        -------
        ndarray of shape (n_samples, n_joints, n_joints)
            Symmetric; kg m^2, with kg m and kg where prismatic joints take part.
        """
        return self._engine.mass_matrix(self._signals(q=q), self._parameters(parameters))

    def forward_dynamics(self, q: Any, dq: Any, tau: Any, *, parameters: Any = None) -> np.ndarray:
        """Joint accelerations that torques cause, without friction.

        Parameters
        ----------
        q, dq : array-like of shape (n_samples, n_joints)
            Positions and velocities.
        tau : array-like of shape (n_samples, n_joints)
            Joint torques, N m or N.
        parameters : array-like of shape (n_bodies, 10), default=None
            Inertial parameters in place of those of the URDF.

        Returns
        -------
        ndarray of shape (n_samples, n_joints)
            rad/s^2 or m/s^2.

        Raises
        ------
        SkidynError
            The inertia matrix is singular: some joint moves no mass.
        """
        tau = self._signals(tau=tau)["tau"]
        bias = self.inverse_dynamics(q, dq, np.zeros_like(tau), parameters=parameters)
        try:
            solved = np.linalg.solve(
                self.mass_matrix(q, parameters=parameters), (tau - bias)[..., np.newaxis]
            )
        except np.linalg.LinAlgError as error:
            raise SkidynError(
                "The mass matrix is singular: a joint moves no mass. Give the links an <inertial>."
            ) from error
        return solved[..., 0]

    def torque_regressor(
        self,
        q: Any,
        dq: Any,
        ddq: Any,
        *,
        dtype: Any = np.float64,
        out: np.ndarray | None = None,
        backend: str = "numpy",
    ) -> np.ndarray:
        """Joint torque per unit of every inertial parameter.

        ``inverse_dynamics(q, dq, ddq) == torque_regressor(q, dq, ddq) @ parameters.ravel()``.

        Parameters
        ----------
        q, dq, ddq : array-like of shape (n_samples, n_joints)
            Positions (rad, m), velocities and accelerations.
        dtype : {numpy.float64, numpy.float32}, default=numpy.float64
            Precision.
        out : ndarray of shape (n_joints, 10 * n_bodies, n_samples), default=None
            Memory to write into, C-contiguous and of type ``dtype``; saves the time that the
            operating system needs to hand out fresh memory.
        backend : {"numpy", "compiled"}, default="numpy"
            ``"compiled"`` works as in :meth:`inverse_dynamics`; a few seconds to compile.

        Returns
        -------
        ndarray of shape (n_samples, n_joints, 10 * n_bodies)
            In the memory the samples come last: ``moveaxis(result, 0, -1)`` is contiguous.
        """
        signals = self._signals(q=q, dq=dq, ddq=ddq)
        _check_backend(backend, dtype)
        return self._engine.torque_regressor(signals, dtype=dtype, out=out, backend=backend)

    def iter_torque_regressor(
        self, q: Any, dq: Any, ddq: Any, chunk: int | None = None, *, backend: str = "numpy"
    ) -> Iterator[tuple[slice, np.ndarray]]:
        """Yield the regressor chunk by chunk, without ever holding all of it.

        Parameters
        ----------
        q, dq, ddq : array-like of shape (n_samples, n_joints)
            Positions (rad, m), velocities and accelerations.
        chunk : int, default=None
            Largest number of samples at a time. None: 3072, or 512 with ``backend="compiled"``.
        backend : {"numpy", "compiled"}, default="numpy"
            ``"compiled"`` works as in :meth:`inverse_dynamics`; a few seconds to compile.

        Yields
        ------
        rows : slice
            The samples.
        Y : ndarray of shape (n_joints, 10 * n_bodies, rows)
            Their regressor, samples last. The memory is used again for the next chunk.
        """
        if chunk is None:
            chunk = 512 if backend == "compiled" else 3072
        if chunk < 1:
            raise SkidynError(f"chunk is {chunk}; expected at least 1.")
        signals = self._signals(q=q, dq=dq, ddq=ddq)
        _check_backend(backend, np.float64)
        run = self._engine.iter_compiled if backend == "compiled" else self._engine.iter_chunks
        yield from run(signals, chunk, "torque_regressor", self._engine.gravity_key())

    def forward_kinematics(self, q: Any, body: int | str = -1) -> tuple[np.ndarray, np.ndarray]:
        """Pose of a body or link frame in the base frame.

        Parameters
        ----------
        q : array-like of shape (n_samples, n_joints)
            Positions, rad or m.
        body : int or str, default=-1
            Position in ``body_names``, or the name of any link of the URDF.

        Returns
        -------
        position : ndarray of shape (n_samples, 3)
            m.
        rotation : ndarray of shape (n_samples, 3, 3)
            Columns are the axes of the frame.
        """
        pose = self._engine.evaluate(self._signals(q=q), "pose", *self._frame(body))
        return np.ascontiguousarray(pose[:, :, 3]), np.ascontiguousarray(pose[:, :, :3])

    def jacobian(self, q: Any, body: int | str = -1) -> np.ndarray:
        """Velocity of a body or link frame per unit joint velocity.

        Parameters
        ----------
        q : array-like of shape (n_samples, n_joints)
            Positions, rad or m.
        body : int or str, default=-1
            Position in ``body_names``, or the name of any link of the URDF.

        Returns
        -------
        ndarray of shape (n_samples, 6, n_joints)
            Linear velocity of the frame's origin (rows 0 to 2) and angular velocity (rows 3 to 5),
            along the axes of the base frame.
        """
        return self._engine.evaluate(self._signals(q=q), "jacobian", *self._frame(body))

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
            Inertial parameters in place of those of the URDF; may require gradients.

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

    def _signals(self, **signals: Any) -> dict[str, np.ndarray]:
        """Signals as float64 arrays of one shape (n_samples, n_joints)."""
        arrays = {}
        n_samples = None
        for name, values in signals.items():
            array = np.asarray(values, dtype=np.float64)
            if array.ndim != 2 or array.shape[1] != self.n_joints:
                raise SkidynError(
                    f"{name} has shape {array.shape}; expected (n_samples, {self.n_joints}), one "
                    f"column for each of {', '.join(self.joint_names[:8])}."
                )
            if n_samples is not None and len(array) != n_samples:
                raise SkidynError(
                    f"{name} has {len(array)} samples, the signals before it {n_samples}."
                )
            n_samples = len(array)
            arrays[name] = array
        return arrays

    def _parameters(self, parameters: Any) -> np.ndarray | None:
        if parameters is None:
            return None
        array = np.asarray(parameters, dtype=np.float64)
        if array.size != 10 * self.n_bodies:
            raise SkidynError(
                f"parameters has shape {array.shape}; expected ({self.n_bodies}, 10): "
                f"{', '.join(_PARAMETER_SYMBOLS)} of each of {', '.join(self.body_names[:8])}."
            )
        return array.reshape(self.n_bodies, 10)

    def _frame(self, body: int | str) -> tuple[int, tuple[float, ...] | None]:
        """Body and, for a link that is fixed to it, the link's 3 x 4 pose in the body's frame."""
        if isinstance(body, str):
            if body not in self.links:
                raise SkidynError(f"The robot {self.name!r} has no link {body!r}.")
            link = self.links[body]
            pose = np.column_stack([link.rotation, link.translation])
            return link.body, tuple(pose.ravel().tolist())
        if not -self.n_bodies <= body < self.n_bodies:
            raise SkidynError(f"body is {body}; the robot has {self.n_bodies} moving bodies.")
        return body % self.n_bodies, None


def _check_backend(backend: str, dtype: Any) -> None:
    if backend not in ("numpy", "compiled"):
        raise SkidynError(f"backend is {backend!r}; expected 'numpy' or 'compiled'.")
    if backend == "compiled" and np.dtype(dtype) != np.float64:
        raise SkidynError("backend='compiled' works in float64 only.")


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
