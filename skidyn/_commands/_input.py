# SPDX-License-Identifier: BSD-3-Clause
"""Inputs of the commands: robots, logs, reports."""

from __future__ import annotations

import argparse
import json
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from skidyn._checks import warn_about_log
from skidyn._commands._arguments import Input, check_files
from skidyn._commands._controllers import Setting, read_controller
from skidyn._commands._output import RECORDED, hashes, working
from skidyn._exceptions import LogWarning, SkidynError
from skidyn._limits import MOST_COLUMNS

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.identification import RBDRegressor
    from skidyn.measurement import Suspicion
    from skidyn.robots import Robot
    from skidyn.simulation import Controller

#: What a function reads from an effect of a report.
_Read = TypeVar("_Read")
#: Remedies that are numbers by column, and those that are passed on as they are.
NUMBERS = ("gain", "zero", "late", "lowpass")
#: Values of options for messages.
_EXAMPLES = {
    "units": "q=deg,time=ms",
    "drive-gains": "'[0.62, 0.5]' (one number for each joint)",
    "columns": "'q=pos_{i},tau=effort_{i}'",
    "gain": "tau3=0.02",
    "zero": "q2=1.57",
    "late": "tau=0.008",
    "lowpass": "tau=0.04",
    "combine": "tau6=tau6+tau7,tau7=tau6-tau7",
    "summed": "q3=q2",
}
AS_GIVEN = (
    "unwrap", "torque_sign", "clock", "drop_repeated", "split_leaps", "restore_gravity", "missing",
)  # fmt: skip


def read_inputs(
    options: argparse.Namespace, *, check: bool = True
) -> tuple[Robot, RBDRegressor, pd.DataFrame, Any, Controller | None]:
    """Robot, model, log, torques, and the controller of the options, which may determine these."""
    from skidyn.identification import RBDRegressor

    robot = read_robot(options)
    frame, tau, controller = read_driven(options, robot, check=check)
    if controller is not None and tau is None:
        from skidyn.simulation import servo_torque

        tau = servo_torque(controller, frame)
    if options.model.endswith(".skops"):
        return robot, stored_model(options.model), frame, tau, controller
    effects = effects_option(options.model)
    model = RBDRegressor(robot, effects, "nominal" if options.nominal else "identified")
    return robot, model, frame, tau, controller


def stored_model(path: str) -> Any:
    """The model in a file."""
    from skidyn._persistence import load_model

    if not Path(path).is_file():
        raise SkidynError(
            f"no file {path}; --model must name a model that skidyn.save_model or skidyn explore "
            "has stored, such as model.skops"
        )
    return load_model(path)


def find_suspicions(
    frame: pd.DataFrame, robot: Robot, options: argparse.Namespace
) -> tuple[Suspicion, ...]:
    """Suspicions about a log, the most influential first, to head a result; none without torque."""
    from skidyn.logs import check_log

    if "tau1" not in frame:
        return ()
    with working("Checking", options):
        quality = check_log(frame, robot)
    for fault in quality.faults:
        warn_about_log(fault)
    # wrong bodies of the description are not an error of the log
    return tuple(check for check in quality.checks if check.check != "bodies")


def effects_option(text: str) -> tuple[str, ...]:
    """Effects of a model besides the rigid body."""
    kinds = listed(text)
    if "rigid_body" not in kinds:
        raise SkidynError(
            "--model must contain rigid_body; it may also contain kinds of the catalogue"
        )
    return tuple(kind for kind in kinds if kind != "rigid_body")


def read_driven(
    options: argparse.Namespace, robot: Robot, *, check: bool = True
) -> tuple[pd.DataFrame, Any, Controller | None]:
    """The log, its torques (None if it has only commands), and the controller of the options."""
    text = getattr(options, "controller", None)
    frame = read_frame(options, robot, check=check, needs_torque=text is None)
    logged = None
    if text is None or "tau1" in frame:
        logged = frame[[f"tau{j + 1}" for j in range(robot.n_joints)]].to_numpy()
    return frame, logged, None if text is None else read_controller(text, robot, frame, logged)


def read_frame(
    options: argparse.Namespace,
    robot: Robot | None,
    *,
    check: bool = True,
    needs_torque: bool = True,
) -> pd.DataFrame:
    """The log, with the columns, units and gains of the options."""
    from skidyn.logs import read_log

    said = reading(options)
    with working("Reading", options):
        return read_log(
            list(options.logs), robot=robot, check=check, needs_torque=needs_torque, **said
        )


def reading(options: argparse.Namespace) -> dict[str, Any]:
    """Arguments of ``read_log`` from the options."""
    said = vars(options)
    arguments = {
        "columns": columns_option(options.columns),
        "units": pairs("units", options.units),
        "drive_gains": json_option("drive-gains", said.get("drive_gains")),
        "rate": options.rate,
        "topics": listed(said.get("topics")),
        "resample_rate": said.get("resample"),
        "order": order_option(said.get("order")),
        "flip": listed(said.get("flip")),
        "combine": pairs("combine", said.get("combine")),
        "summed": pairs("summed", said.get("summed")),
        **{name: pairs(name, said.get(name), numbers=True) for name in NUMBERS},
        **{name: said.get(name) for name in AS_GIVEN},
        "derive": listed(said.get("derive")),
        "placeholder": placeholder_option(said.get("placeholder")),
        "gravity": gravity_option(said.get("gravity")),
    }
    # defaults are left to read_log, so that a script made from this contains only given options
    always = ("columns", "units", "drive_gains", "rate")
    unsaid: tuple[Any, ...] = ([], "recorded", "auto", "error")

    def given(value: Any) -> bool:
        # a zero is given: it is refused, not taken for False
        return value is not None and value is not False and value not in unsaid

    return {k: v for k, v in arguments.items() if k in always or given(v)}


def listed(text: str | None) -> list[str]:
    """Values separated by commas."""
    return [word.strip() for word in text.split(",") if word.strip()] if text else []


def pairs(name: str, text: str | None, numbers: bool = False) -> Any:
    """``q=deg,time=ms`` as a mapping; JSON is accepted as well."""
    if text is None:
        return None
    if text.lstrip().startswith(("{", "[")):
        content = json_option(name, text)
        if not isinstance(content, dict):
            raise SkidynError(f"{name} is {text}; expected NAME=VALUE or a JSON object")
        return content
    said: dict[str, Any] = {}
    for word in listed(text):
        key, equals, value = (part.strip() for part in word.partition("="))
        if not equals or not key or not value:
            hint = f", for example --{name} {_EXAMPLES[name]}" if name in _EXAMPLES else ""
            raise SkidynError(f"--{name} {text}: {word!r} is not NAME=VALUE{hint}")
        if numbers and key in said:  # successive checks may each find a part
            said[key] = _both(name, said[key], number(name, value))
        else:
            said[key] = number(name, value) if numbers else value
    return said


def _both(name: str, one: Any, other: Any) -> Any:
    """Two numbers of one remedy as one."""
    if isinstance(one, tuple) or isinstance(other, tuple):  # a delay that grows
        pairs = [x if isinstance(x, tuple) else (x, 0.0) for x in (one, other)]
        return tuple(map(sum, zip(*pairs, strict=True)))
    return one * other if name == "gain" else one + other


def columns_option(text: str | None) -> Any:
    """``q=pos_{i},tau=8-14`` as a mapping; numbers are positions of columns, from 0."""
    said = pairs("columns", text)
    for key, value in (said or {}).items():
        hit = re.fullmatch(r"(\d+)(?:-(\d+))?", value) if isinstance(value, str) else None
        if hit:
            first, last = int(hit[1][:9]), int((hit[2] or hit[1])[:9])
            if last - first > MOST_COLUMNS:
                raise SkidynError(f"columns: {value} are more than {MOST_COLUMNS} columns")
            said[key] = list(range(first, last + 1)) if hit[2] else first
    return said


def order_option(text: str | None) -> Any:
    """``2,1,3`` as a list, ``q=2,1,3,tau=3,2,1`` as a mapping."""
    if text is None:
        return None
    if "=" not in text:
        return joint_numbers(text)
    parts = re.split(r",?\s*(\w+)\s*=", text)
    if parts[0].strip():
        raise SkidynError(
            f"--order {text}: {parts[0]!r} belongs to no quantity; expected for example 2,1,3 or "
            "motion=2,1,3,tau=3,2,1"
        )
    return {q: joint_numbers(numbers) for q, numbers in zip(parts[1::2], parts[2::2], strict=True)}


def placeholder_option(text: str | None) -> Any:
    """``9999,q=-1`` as a mapping of all signals, quantities or columns to their values."""
    if text is None or text.lstrip().startswith(("{", "[")):
        return json_option("placeholder", text)
    said: dict[str, list[float]] = {}
    for word in listed(text):
        name, _, value = word.rpartition("=")
        said.setdefault(name.strip() or "all", []).append(number("placeholder", value))
    return said


#: A number, and a delay that grows with the time: 0.013+0.0005*t.
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_GROWING = re.compile(rf"({_NUMBER}(?=[+-]))?({_NUMBER})\*t")


def number(name: str, text: str) -> Any:
    """A number; a delay may grow with the time, and is two numbers then."""
    hit = _GROWING.fullmatch(text.replace(" ", "")) if name == "late" else None
    if hit:
        return float(hit[1] or 0.0), float(hit[2])
    try:
        return float(text)
    except ValueError:
        also = ", or one that grows such as 0.013+0.0005*t" if name == "late" else ""
        raise SkidynError(f"--{name}: {text!r} is not a number{also}") from None


def covered_joints(options: argparse.Namespace) -> list[str] | None:
    """Joints of the robot that the log covers; None for all."""
    return [name.strip() for name in options.joints.split(",")] if options.joints else None


def read_robot(options: argparse.Namespace) -> Robot:
    from skidyn.robots import Robot

    path = Path(options.urdf)
    if not path.is_file():
        raise SkidynError(f"no file {options.urdf}; --urdf must name the description of the robot")
    gravity = gravity_option(getattr(options, "gravity", None))
    robot = Robot.from_file(path, joints=covered_joints(options))
    return robot if gravity is None else robot.with_gravity(gravity)


def gravity_option(text: str | None) -> Any:
    """``0,0,9.81`` as numbers; ``none`` as it is."""
    if text is None:
        return None
    return "none" if text.strip() == "none" else [number("gravity", w) for w in listed(text)]


def embedded_robot(name: str) -> Robot:
    from skidyn import datasets

    known = embedded_robots()
    if name not in known:
        raise SkidynError(f"no embedded robot {name!r}; there are {', '.join(known)}")
    robot: Robot = getattr(datasets, f"load_{name}")()
    return robot


def embedded_robots() -> list[str]:
    from skidyn import datasets

    names = (n.removeprefix("load_") for n in datasets.__all__ if n.startswith("load_"))
    return sorted(set(names) - {"recording", "demo_log"})


def json_option(name: str, text: str | None) -> Any:
    if text is None:
        return None
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        example = _EXAMPLES.get(name)
        hint = f"; expected for example --{name} {example}" if example else ""
        raise SkidynError(f"--{name} {text} is not JSON: {error}{hint}") from None


def joint_numbers(text: str | None) -> list[int] | None:
    if text is None:
        return None
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise SkidynError(f"{text!r}: joints are numbers from 1, such as 1,4") from None


def recorded_options(options: argparse.Namespace) -> argparse.Namespace:
    """Options of the diagnosis that a report records, with those of this command.

    Files of the report are searched in its own folder, then in the working directory.
    """
    if not Path(options.report).is_file():
        raise SkidynError(
            f"no file {options.report}; --from must name a report of skidyn diagnose, as written "
            "by --out report.json"
        )
    try:
        report = json.loads(Path(options.report).read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise SkidynError(f"{options.report} is not a report of skidyn diagnose: {error}") from None
    provenance = report.get("provenance") if isinstance(report, dict) else None
    provenance = provenance if isinstance(provenance, dict) else {}
    recorded = provenance.get("options")
    if not isinstance(recorded, dict) or not {"logs", "urdf"} <= set(recorded):
        raise SkidynError(f"{options.report} records no log; it must come from skidyn diagnose")
    # Nothing else is used, in particular no output paths.
    recorded = {"model": "rigid_body", "nominal": False} | recorded
    recorded = {name: recorded.get(name) for name in RECORDED}
    for name, value in recorded.items():
        parts = value if name == "logs" and isinstance(value, list) else []
        if not isinstance(value, RECORDED[name]) or not all(isinstance(p, str) for p in parts):
            raise SkidynError(
                f"{options.report}: option {name} of the diagnosis is {value!r}; it must come from "
                "skidyn diagnose"
            )
    known = provenance.get("sha256")
    known = known if isinstance(known, dict) else {}
    given = {name: value for name, value in vars(options).items() if value is not None}
    folder = Path(options.report).parent
    for name in [*recorded["logs"], *([] if "urdf" in given else [recorded["urdf"]])]:
        found = _found(name, folder)
        if known.get(name) not in (digest := hashes([found])).values() and digest:
            warnings.warn(
                f"{found} has changed since {options.report} was written", LogWarning, stacklevel=2
            )
    recorded["logs"] = [Input(_found(name, folder)) for name in recorded["logs"]]
    recorded["urdf"] = Input(_found(recorded["urdf"], folder))
    if recorded["model"].endswith(".skops"):
        recorded["model"] = Input(_found(recorded["model"], folder))
    both = argparse.Namespace(**{**recorded, **vars(options), **given})
    both.urdf = given.get("urdf", recorded["urdf"])
    check_files(both)
    return both


def read_effects(path: str, read: Callable[[Any], _Read | None]) -> list[_Read]:
    """What a function reads from the effects of a report, which may be untrusted, except None."""
    effects = json.loads(Path(path).read_text(encoding="utf-8")).get("effects")
    found = []
    for entry in effects if isinstance(effects, list) else ():
        try:
            found.append(read(entry))
        except (AttributeError, KeyError, IndexError, TypeError, ValueError):
            raise SkidynError(
                f"{path}: an entry of effects is {entry!r}; it must come from skidyn diagnose"
            ) from None
    return [x for x in found if x is not None]


def settings_of(path: str) -> list[Setting]:
    """Settings of servos among the effects of a report, which may be untrusted."""
    from skidyn.effects import get_effect, list_effects

    settings = {kind: get_effect(kind) for kind in list_effects() if get_effect(kind).of_servo}

    def setting(entry: Any) -> Setting | None:
        if entry["kind"] not in settings:
            return None
        names = [c.name for c in settings[entry["kind"]].coefficients]
        values = {name: float(entry["parameters"][name]["value"]) for name in names}
        return Setting(entry["kind"], int(entry["joints"][0]), values)

    return read_effects(path, setting)


def _found(name: str, folder: Path) -> str:
    """A file of a report: in the folder of the report, else in the working directory."""
    beside = folder / name
    return str(beside) if beside.exists() else name
