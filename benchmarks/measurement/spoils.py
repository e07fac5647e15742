# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes to be made in logs.

Each returns the log, the stated robot, and the expected suspicion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter1d
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from skidyn.measurement import Suspicion
from skidyn.robots import Robot


@dataclass
class Spoiled:
    """A log with a mistake, and what names it."""

    frame: pd.DataFrame
    robot: Robot
    checks: tuple[str, ...] = ()
    option: str = ""
    joints: tuple[int, ...] | None = None
    allowed: tuple[str, ...] = ()
    equivalent: tuple[str, ...] = ()

    @property
    def says(self) -> str:
        """What should be said, in short."""
        return f"{'|'.join(self.checks)} {self.option} {self.joints or ''}"

    def is_right(self, told: Suspicion) -> bool:
        """Whether the right check has the right remedy, on the right joints."""
        remedy = told.remedy.option if told.remedy else ""
        if told.suspicion.startswith("either "):  # its evidence states the option of one cause
            options = (option for option in (self.option, *self.equivalent) if option)
            remedy = next((option for option in options if option in told.evidence), "")
        if told.check in self.checks and remedy in self.equivalent:
            return True
        joints = self.joints is None or set(told.joints) == set(self.joints)
        return told.check in self.checks and remedy.startswith(self.option) and joints

    def follows(self, told: Suspicion) -> bool:
        """Whether something else that is told is true as well."""
        return told.check in self.allowed


Spoil = Callable[[pd.DataFrame, Robot, np.random.Generator], Spoiled | None]


class NoJointMovesError(Exception):
    """No joint of a log moves that a mistake could be made with."""


def columns(quantity: str, n: int) -> list[str]:
    return [f"{quantity}{k + 1}" for k in range(n)]


def in_runs(log: pd.DataFrame, names: list[str], change: Callable) -> pd.DataFrame:
    """Columns changed within each trajectory: ``change(time, values)``."""
    out = {name: log[name].to_numpy(float).copy() for name in names}
    number = log["trajectory"].to_numpy()
    time = log["time"].to_numpy()
    for run in np.unique(number):
        rows = number == run
        for name in names:
            out[name][rows] = change(time[rows], out[name][rows])
    return log.assign(**out)


def moved(log: pd.DataFrame, robot: Robot, rng: np.random.Generator, turning: bool = False) -> int:
    """A joint that moves and has torque.

    Raises
    ------
    NoJointMovesError
        If none does: the mistake cannot be made in this log.
    """
    span = np.array([np.ptp(log[f"q{k + 1}"]) for k in range(robot.n_joints)])
    able = span > 0.05
    if turning:
        able &= np.array([kind == "revolute" for kind in robot.joint_types])
    if not able.any():
        raise NoJointMovesError
    return int(rng.choice(np.flatnonzero(able)))


def joints_of(log: pd.DataFrame, quantity: str, robot: Robot) -> np.ndarray:
    return log[columns(quantity, robot.n_joints)].to_numpy(dtype=float)


def felt(log: pd.DataFrame, robot: Robot, pull: np.ndarray) -> bool:
    """Whether some joint feels much of another gravity torque than the stated bodies have."""
    change = pull - robot.gravity_torque(joints_of(log, "q", robot))
    return bool(np.any(np.std(change, axis=0) > 0.2 * joints_of(log, "tau", robot).std(axis=0)))


def mirrors(log: pd.DataFrame, robot: Robot) -> bool:
    """Whether the opposite motion has the opposite torque, as of an arm in a vertical plane.

    Turning round one joint is then the mirror image of turning round all others.
    """
    q = joints_of(log.iloc[::10], "q", robot)
    there, back = (robot.inverse_dynamics(x, x, x) for x in (q, -q))
    return bool(np.allclose(there, -back, atol=1e-9 + 1e-6 * np.abs(there).max()))


def signs(*quantities: str) -> Spoil:
    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
        k = moved(log, robot, rng, turning="q" in quantities) + 1
        names = [f"{quantity}{k}" for quantity in quantities]
        told = [f"{name}" for name in names if not (name.startswith("dq") and len(names) > 1)]
        check = "velocity" if quantities == ("dq",) else "reading"
        if "q" in quantities and f"ddq{k}" in log.columns:
            names.append(f"ddq{k}")
        changed = log.assign(**{name: -log[name] for name in names})
        if "q" in quantities and not felt(
            log, robot, robot.gravity_torque(joints_of(changed, "q", robot))
        ):
            return None  # it looks the same from either side
        option, equivalent = f"--flip {','.join(told)}", []
        if set(quantities) == {"q", "dq", "tau"} and mirrors(log, robot):
            others = [j + 1 for j in range(robot.n_joints) if j + 1 != k]
            equivalent = [f"--flip {','.join(f'q{j},tau{j}' for j in others)}"]
        return Spoiled(changed, robot, (check,), option, (k,), equivalent=tuple(equivalent))

    return spoil


def all_torques(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    names = columns("tau", robot.n_joints)
    changed = log.assign(**{name: -log[name] for name in names})
    return Spoiled(changed, robot, ("reading",), "--flip tau1")


def exchanged(*quantities: str) -> Spoil:
    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
        order = np.arange(robot.n_joints)
        a, b = rng.choice(robot.n_joints, 2, replace=False)
        order[[a, b]] = order[[b, a]]
        changes = {
            f"{q}{j + 1}": log[f"{q}{k + 1}"]
            for q in quantities
            for j, k in enumerate(order)
            if f"{q}{k + 1}" in log.columns
        }
        words = ",".join(str(k + 1) for k in order)
        option = words if len(quantities) > 1 else f"{quantities[0]}={words}"
        check = "velocity" if quantities == ("dq",) else "reading"
        return Spoiled(log.assign(**changes), robot, (check,), f"--order {option}")

    return spoil


def mounted(least: float, most: float) -> Spoil:
    """A robot whose description has gravity in another direction than the log."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        axis = np.append(rng.normal(size=2), 0.0)
        angle = np.deg2rad(rng.uniform(least, most))
        turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle)
        claimed = replace(robot, gravity=turn.apply(np.array(robot.gravity)))
        if not felt(log, robot, claimed.gravity_torque(joints_of(log, "q", robot))):
            return None
        return Spoiled(log, claimed, ("reading",), "--gravity=")

    return spoil


def true_gravity(log: pd.DataFrame, robot: Robot) -> np.ndarray:
    """Gravity torque of bodies that are fitted to the log."""
    from skidyn.identification import RBDRegressor

    n = robot.n_joints
    tau = log[columns("tau", n)].to_numpy()
    rows = slice(None, None, max(1, len(log) // 4000))
    model = RBDRegressor(robot, ("viscous", "coulomb", "rotor_inertia")).fit(
        log.iloc[rows], tau[rows]
    )
    bodies = model.inertial_parameters_
    return robot.gravity_torque(log[columns("q", n)].to_numpy(), parameters=bodies)


#: How near gravity of identified bodies is to that of the stated ones that either gives it back.
NEAR = 0.05


def compensated(stated: bool) -> Spoil:
    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
        n = robot.n_joints
        q = log[columns("q", n)].to_numpy()
        pull = robot.gravity_torque(q) if stated else true_gravity(log, robot)
        if np.all(np.std(pull, axis=0) < 0.05 * log[columns("tau", n)].std().to_numpy()):
            return None  # joints on which gravity does not change
        names = columns("tau", n)
        changes = dict(zip(names, (log[names].to_numpy() - pull).T, strict=True))
        near = np.abs(pull - robot.gravity_torque(q)).max() < NEAR * np.abs(pull).max()
        option = "--restore-gravity" if stated else "--" if near else "--gravity none"
        return Spoiled(log.assign(**changes), robot, ("reading",), option)

    return spoil


def factor(quantity: str, size: float, check: str, option: str) -> Spoil:
    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
        turning = [kind == "revolute" for kind in robot.joint_types]
        if quantity in ("q", "dq") and not all(turning):
            return None
        names = [n for n in log.columns if n.rstrip("0123456789") == quantity]
        return Spoiled(
            log.assign(**{name: size * log[name] for name in names}), robot, (check,), option
        )

    return spoil


def one_factor(quantity: str, size: float, check: str, option: str) -> Spoil:
    """The unit or scale of one joint."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        k = moved(log, robot, rng, turning=quantity != "tau") + 1
        name = f"{quantity}{k}"
        told = option.replace("#", name)
        return Spoiled(log.assign(**{name: size * log[name]}), robot, (check,), told, (k,))

    return spoil


def both_degrees(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    if any(kind != "revolute" for kind in robot.joint_types):
        return None
    names = [*columns("q", robot.n_joints), *columns("dq", robot.n_joints)]
    changed = log.assign(**{name: np.rad2deg(log[name]) for name in names})
    return Spoiled(changed, robot, ("position_unit",), "--units q=deg,dq=deg/s")


def motor_side(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque before the gears."""
    ratio = rng.choice([50.0, 80.0, 100.0, 120.0])
    names = columns("tau", robot.n_joints)
    changed = log.assign(**{n: log[n] / ratio for n in names})
    return Spoiled(changed, robot, ("torque_scale",), "--gain")


def motor_angles(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Positions and velocities before the gears."""
    if any(kind != "revolute" for kind in robot.joint_types):
        return None
    ratio = rng.choice([50.0, 80.0, 100.0, 120.0])
    names = [*columns("q", robot.n_joints), *columns("dq", robot.n_joints)]
    changed = log.assign(**{n: log[n] * ratio for n in names})
    return Spoiled(changed, robot, ("position_unit", "position_scale"))


def ticks(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Counts of an encoder in the place of positions."""
    if any(kind != "revolute" for kind in robot.joint_types):
        return None
    counts = int(rng.choice([4096, 16384, 65536, 2**20]))
    names = columns("q", robot.n_joints)
    changed = log.assign(**{n: np.round(log[n] * counts / 2 / np.pi) for n in names})
    return Spoiled(changed, robot, ("position_unit", "position_scale"))


def currents(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    gains = rng.uniform(5, 60, robot.n_joints)
    names = columns("tau", robot.n_joints)
    changed = log.assign(**{n: log[n] / g for n, g in zip(names, gains, strict=True)})
    return Spoiled(changed, robot, ("torque_scale",), "--gain")


def commands(log: pd.DataFrame, robot: Robot) -> dict[str, pd.Series]:
    """Commanded positions of a servo that is a spring."""
    joints = range(1, robot.n_joints + 1)
    return {f"cmd{k}": log[f"q{k}"] + 1e-3 * log[f"tau{k}"] for k in joints}


def unsigned(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    names = columns("tau", robot.n_joints)
    changed = log.assign(**{n: log[n].abs() for n in names}, **commands(log, robot))
    return Spoiled(changed, robot, ("unsigned_torque",), "--torque-sign")


def changing_sign(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> int | None:
    """A joint whose torque has both signs."""
    tau = log[columns("tau", robot.n_joints)].to_numpy()
    share = np.minimum((tau > 0).mean(axis=0), (tau < 0).mean(axis=0))
    able = np.flatnonzero(share > 0.1)
    return int(rng.choice(able)) if len(able) else None


def one_unsigned(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    k = changing_sign(log, robot, rng)
    if k is None:
        return None
    name = f"tau{k + 1}"
    changed = log.assign(**{name: log[name].abs()}, **commands(log, robot))
    return Spoiled(changed, robot, ("unsigned_torque",), "--torque-sign", (k + 1,))


def half_wave(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    k = changing_sign(log, robot, rng)
    if k is None:
        return None
    name = f"tau{k + 1}"
    changed = log.assign(**{name: log[name].clip(lower=0)})
    return Spoiled(changed, robot, ("unsigned_torque",), "", (k + 1,), ("clipped_torque",))


def clipped(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    k = moved(log, robot, rng)
    name = f"tau{k + 1}"
    limit = float(np.quantile(log[name].abs(), 0.85))
    changed = log.assign(**{name: log[name].clip(-limit, limit)})
    return Spoiled(changed, robot, ("clipped_torque",), "", (k + 1,))


def held(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    every = int(rng.choice([3, 4, 5]))
    names = columns("tau", robot.n_joints)
    changed = in_runs(log, names, lambda t, x: x[np.arange(len(x)) // every * every])
    return Spoiled(changed, robot, ("held_torque",), "", None, ("torque_delay",))


def constant(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    runs = log["trajectory"].unique()
    if len(runs) < 2:
        return None
    k, run = moved(log, robot, rng), rng.choice(runs)
    changed = log.copy()
    changed.loc[changed["trajectory"] == run, f"tau{k + 1}"] = float(log[f"tau{k + 1}"].iloc[0])
    return Spoiled(changed, robot, ("constant_torque",), "", (k + 1,))


def zero(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """A position whose zero is elsewhere; that of an axis along gravity at the base has none."""
    k = moved(log, robot, rng, turning=True)
    offset = rng.choice([-1.0, 1.0]) * np.deg2rad(rng.uniform(30, 180))
    changed = log.assign(**{f"q{k + 1}": log[f"q{k + 1}"] + offset})
    if not felt(log, robot, robot.gravity_torque(joints_of(changed, "q", robot))):
        return None
    return Spoiled(changed, robot, ("reading",), f"--zero q{k + 1}=", (k + 1,))


def shifted(names: tuple[str, ...], least: float, most: float, check: str, option: str) -> Spoil:
    """Channels that are late; recordings begin when the first late values are there."""

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        lag = float(rng.uniform(least, most))
        every = [c for c in log.columns if c.rstrip("0123456789") in names]
        changed = in_runs(log, every, lambda t, x: np.interp(t - lag, t, x))
        begin = log.groupby("trajectory")["time"].transform("min")
        changed = changed[log["time"] - begin >= lag].reset_index(drop=True)
        return Spoiled(changed, robot, (check,), option)

    return spoil


def jitter(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    steps = np.diff(log["time"])
    if np.quantile(steps, 0.95) > 1.05 * np.quantile(steps, 0.3):
        return None  # uneven as it is
    size = rng.choice([1e-4, 3e-4, 1e-3])
    stamps = log["time"] + rng.uniform(-size, size, len(log))
    return Spoiled(log.assign(time=stamps), robot, ("clock_jitter",), "--clock regular")


def short_floats(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    steps = np.diff(log["time"])
    if np.quantile(steps, 0.95) > 1.05 * np.quantile(steps, 0.3):
        return None
    stamps = np.float32(log["time"] + 4000.0).astype(float)
    return Spoiled(log.assign(time=stamps), robot, ("clock_jitter",), "--clock regular")


def repeated(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Rows that are those before them, for as long as nothing new was reported."""
    rows = np.arange(len(log))
    again = (rng.random(len(log)) < 0.25) & (log["trajectory"].diff() == 0).to_numpy()
    last = np.maximum.accumulate(np.where(again, 0, rows))
    stale = log.iloc[last].reset_index(drop=True)
    return Spoiled(stale.assign(time=log["time"]), robot, ("repeated_rows",), "--drop-repeated")


def interpolated(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    every = [c for c in log.columns if c.rstrip("0123456789") in ("q", "dq", "ddq", "tau")]
    n = int(rng.choice([3, 4, 5]))
    changed = in_runs(log, every, lambda t, x: np.interp(t, t[::n], x[::n]))
    return Spoiled(changed, robot, ("interpolated_rows",))


def joined(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Recordings that were joined as if they were one."""
    runs = log["trajectory"].to_numpy()
    if len(np.unique(runs)) < 2:
        return None
    steps = np.diff(log["time"])
    steps[runs[1:] != runs[:-1]] = np.median(steps)
    time = np.r_[0.0, np.cumsum(steps)]
    return Spoiled(log.assign(time=time, trajectory=0), robot, ("joined",), "--split-leaps")


def wrapped(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    k = moved(log, robot, rng, turning=True)
    q = log[f"q{k + 1}"].to_numpy()
    middle = np.median(q)
    changed = log.assign(**{f"q{k + 1}": (q - middle) % (2 * np.pi)})
    leaps = np.abs(np.diff(changed[f"q{k + 1}"])) > np.pi
    if not leaps[log["trajectory"].diff().to_numpy()[1:] == 0].any():
        return None  # recordings that are turns apart move alike
    return Spoiled(changed, robot, ("wrapped_position",), "--unwrap", (k + 1,), ("reading",))


def bodies(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """A description whose links have other masses."""
    size = np.exp(rng.choice([-1, 1], robot.n_bodies) * rng.uniform(1.0, 1.8, robot.n_bodies))
    parameters = np.asarray(robot.inertial_parameters).reshape(robot.n_bodies, 10)
    claimed = replace(robot, inertial_parameters=parameters * size[:, None])
    return Spoiled(log, claimed, ("bodies", "torque_scale"), "", None)


def friction_taken_off(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque without friction, as of a driver that compensates it."""
    from skidyn.identification import RBDRegressor

    n = robot.n_joints
    names = columns("tau", n)
    tau = log[names].to_numpy()
    model = RBDRegressor(robot, ("viscous", "coulomb")).fit(log, tau)
    friction = model.predict(log) - RBDRegressor(robot, ()).fit(log, tau).predict(log)
    terms = model.effect_torques(log) if hasattr(model, "effect_torques") else None
    friction = friction if terms is None else sum(terms.values())
    changes = dict(zip(names, (tau - friction).T, strict=True))
    return Spoiled(log.assign(**changes), robot, ("no_friction",))


def computed(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque of the stated bodies along the motion, as a controller computes it."""
    n = robot.n_joints
    names, runs = columns("q", n), log[["time", "trajectory"]]
    q = in_runs(log, names, lambda t, x: savgol_filter(x, 15, 4))[names]
    dq = in_runs(q.join(runs), names, lambda t, x: np.gradient(x, t))[names]
    ddq = in_runs(dq.join(runs), names, lambda t, x: np.gradient(savgol_filter(x, 15, 3), t))[names]
    tau = robot.inverse_dynamics(q.to_numpy(), dq.to_numpy(), ddq.to_numpy())
    changes = dict(zip(columns("tau", n), tau.T, strict=True))
    return Spoiled(log.assign(**changes), robot, ("computed_torque",), "", None, ("no_friction",))


def filtered(quantity: str, cutoff: float, check: str) -> Spoil:
    """A channel through a causal low pass of first order."""

    def change(time: np.ndarray, values: np.ndarray) -> np.ndarray:
        out = values.copy()
        for i in range(1, len(out)):
            a = 1 - np.exp(-2 * np.pi * cutoff * (time[i] - time[i - 1]))
            out[i] = out[i - 1] + a * (values[i] - out[i - 1])
        return out

    def spoil(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
        names = columns(quantity, robot.n_joints)
        return Spoiled(in_runs(log, names, change), robot, (check,))

    return spoil


def coarse(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled | None:
    """Positions of an encoder of 12 bits."""
    step = 2 * np.pi / 4096
    changes = {name: np.round(log[name] / step) * step for name in columns("q", robot.n_joints)}
    if any(kind != "revolute" for kind in robot.joint_types):
        return None
    return Spoiled(log.assign(**changes), robot, ("coarse_position",))


def unrelated(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    """Torque of one joint that has nothing to do with its motion."""
    k = moved(log, robot, rng)
    tau = log[f"tau{k + 1}"].to_numpy()
    noise = gaussian_filter1d(rng.normal(size=len(tau)), 40)
    noise *= np.std(tau) / np.std(noise)
    return Spoiled(log.assign(**{f"tau{k + 1}": noise}), robot, ("unexplained",), "", (k + 1,))


def nothing(log: pd.DataFrame, robot: Robot, rng: np.random.Generator) -> Spoiled:
    return Spoiled(log, robot)


TURN = 2 * np.pi
SPOILS: dict[str, Spoil] = {
    "nothing": nothing,
    "torque_sign": signs("tau"),
    "all_torque_signs": all_torques,
    "motion_sign": signs("q", "dq"),
    "joint_sign": signs("q", "dq", "tau"),
    "velocity_sign": signs("dq"),
    "order": exchanged("q", "dq", "ddq", "tau"),
    "torque_order": exchanged("tau"),
    "velocity_order": exchanged("dq"),
    "tilt": mounted(30, 60),
    "wall": mounted(90, 90),
    "ceiling": mounted(180, 180),
    "compensated": compensated(True),
    "compensated_well": compensated(False),
    "friction_taken_off": friction_taken_off,
    "zero": zero,
    "unsigned": unsigned,
    "one_unsigned": one_unsigned,
    "half_wave": half_wave,
    "clipped": clipped,
    "held": held,
    "constant": constant,
    "computed": computed,
    "unrelated": unrelated,
    "currents": currents,
    "motor_torque": motor_side,
    "motor_angles": motor_angles,
    "ticks": ticks,
    "newton_millimetres": factor("tau", 1e3, "torque_scale", "--units tau=Nmm"),
    "one_newton_millimetres": one_factor("tau", 1e3, "torque_scale", "--gain #="),
    "one_gain": one_factor("tau", 4.0, "torque_scale", "--gain #="),
    "milliseconds": factor("time", 1e3, "clock_unit", "--units time=ms"),
    "clock_rate": factor("time", 2.0, "clock_unit", "--gain time=0.5"),
    "degrees": factor("q", 180 / np.pi, "position_unit", "--units q=deg"),
    "both_degrees": both_degrees,
    "one_degrees": one_factor("q", 180 / np.pi, "velocity", "--units #=deg"),
    "revolutions": factor("q", 1 / TURN, "position_unit", "--units q=rev"),
    "degrees_per_second": factor("dq", 180 / np.pi, "velocity", "--units dq=deg/s"),
    "rpm": factor("dq", 60 / TURN, "velocity", "--units dq=rpm"),
    "velocity_scale": one_factor("dq", 1.5, "velocity", "--gain #="),
    "velocity_late": shifted(("dq",), 0.015, 0.04, "velocity_delay", "--late dq="),
    "late": shifted(("tau",), 0.008, 0.03, "torque_delay", "--late tau=0"),
    "early": shifted(("q", "dq", "ddq"), 0.008, 0.03, "torque_delay", "--late tau=-0"),
    "torque_filtered": filtered("tau", 4.0, "torque_delay"),
    "position_filtered": filtered("q", 4.0, "velocity_delay"),
    "jitter": jitter,
    "float32_clock": short_floats,
    "repeated_rows": repeated,
    "interpolated": interpolated,
    "joined": joined,
    "wrapped": wrapped,
    "bodies": bodies,
    "coarse": coarse,
}
