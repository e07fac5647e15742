# SPDX-License-Identifier: BSD-3-Clause
"""Mapping of the column names of loggers to ``q1 .. qn, dq1 .. dqn, tau1 .. taun``."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from skidyn._exceptions import LogError
from skidyn._limits import LONGEST_NAME, MOST_COLUMNS
from skidyn._text import counted, suggest
from skidyn._units import split_unit

#: A joint number above this and above the number of columns is a damaged name: a list of that many
#: joints could fill the memory.
MANY_JOINTS = 1000

#: Spellings of each quantity in recordings, compared in lower case without separators.
SPELLINGS: dict[str, tuple[str, ...]] = {
    "q": ("q", "pos", "position", "positions", "jointposition", "jointpositions", "angle")
    + ("actualq", "qactual", "qmeas", "qmeasured", "measuredq", "jointangle", "theta", "qpos")
    + ("jointpos", "observationstate"),
    "dq": ("dq", "qd", "qdot", "vel", "velocity", "velocities", "jointvelocity", "jointvelocities")
    + ("speed", "actualqd", "dqactual", "qdmeas", "dqmeas", "dqmeasured", "omega", "qvel")
    + ("jointvel", "observationvelocity"),
    "ddq": ("ddq", "qdd", "qddot", "acc", "acceleration", "accelerations", "jointacceleration")
    + ("qacc",),
    "tau": ("tau", "torque", "torques", "effort", "efforts", "jointtorque", "jointtorques", "trq")
    + ("tauj", "jointeffort", "actualtorque", "taumeas", "taumeasured", "measuredtorque")
    + ("qtorque", "qtau", "observationeffort", "observationtorque"),
    "i": ("i", "current", "currents", "motorcurrent", "actualcurrent", "jointcurrent")
    + ("observationcurrent",),
    "temp": ("temp", "temperature", "temperatures", "jointtemperature", "motortemperature"),
    "cmd": ("cmd", "command", "commands", "commandedposition", "positioncommand", "qcmd", "qdes")
    + ("qdesired", "desiredposition", "targetposition", "setpoint", "qref", "action", "control")
    + ("targetq", "qtarget", "goalposition", "goalpos", "referenceposition", "desiredq")
    + ("positioncmd", "poscmd", "positiondesired", "posdes", "commandedpos", "desiredpos"),
    "time": ("time", "t", "timestamp", "stamp", "times", "timesec", "timeseconds")
    + ("elapsed", "elapsedtime", "timefromstart"),
    "trajectory": ("trajectory", "traj", "run", "episode", "trajectoryid", "episodeindex"),
}
#: Quantities with one column per joint, in the order of the columns of a log.
PER_JOINT = ("q", "dq", "ddq", "tau", "i", "temp", "cmd")
KEYS = ("time", "trajectory")
_QUANTITY_OF = {word: quantity for quantity, words in SPELLINGS.items() for word in words}


@dataclass
class NameMatch:
    """Assignment of source columns to signals, by their names in the log (``q1``).

    ``joint_names`` are in column order, ``notes`` are decisions to be reported, and ``units`` the
    columns of the source with the unit in their header.
    """

    columns: dict[str, str] = field(default_factory=dict)
    joint_names: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    units: dict[str, tuple[str, str]] = field(default_factory=dict)


def match_names(
    names: Sequence[str],
    *,
    robot_joints: Sequence[str] | None = None,
    columns: Mapping[str, str | int | Sequence[str | int]] | None = None,
    source: str = "the log",
    listed: Mapping[str, Sequence[str]] | None = None,
) -> NameMatch:
    """Assign the unique columns of a source to signals, in the order of the robot's joints.

    ``columns`` are the user's, which have priority over any guess: ``{"q1": "pos_a"}``, ``{"q":
    ["pos_a", "pos_b"]}``, ``{"q": "pos_{joint}"}`` or ``{"q": "pos_{i}"}`` (from 0 or 1, as the
    columns are); a number is the position of a column. ``listed`` are the joints that the source
    lists beside numbered columns, in their order, by column. A LogError is raised if a column is
    absent, or joints do not match the robot.
    """
    _refuse_too_many(names, source)
    match = NameMatch()
    spoken = _said(names, columns or {}, robot_joints, source)
    taken = set(spoken.values())
    by_index, by_joint = _guess([name for name in names if name not in taken])
    for key in KEYS:
        if key not in spoken and key in by_index:
            match.columns[key] = by_index[key][0]
            if others := by_index[key].others.get(0):
                taken_from = f"taken from {by_index[key][0]!r}, not from {_listed(others)}"
                match.notes.append(f"{source}: {key} is {taken_from}")
    said_quantities = {re.sub(r"\d+$", "", name) for name in spoken}
    match.columns.update(spoken)
    for quantity in PER_JOINT:
        if quantity in said_quantities:
            continue
        indexed, named = by_index.get(quantity, _Found()), by_joint.get(quantity, _Found())
        if indexed:
            indexed.refuse_choice(quantity, source)
            by_name = _with_joints(indexed, listed or {}, robot_joints, match.notes)
            if by_name is None:  # numbered from 1; a logger that counts from 0 has a 0
                shift = 1 if 0 in indexed else 0
                for index, name in sorted(indexed.items()):
                    match.columns[f"{quantity}{index + shift}"] = name
            else:
                _place_by_joint(match, quantity, by_name, robot_joints, source)
        elif named and (robot_joints is not None or "q" not in by_index):
            named.refuse_choice(quantity, source)
            _place_by_joint(match, quantity, named, robot_joints, source)
    n = _number_of_joints(match)
    if robot_joints is not None and n and n != len(robot_joints):
        raise LogError(
            f"{source} has {counted(n, 'joint')} ({_listed(match.joint_names) or 'by number'}), "
            f"the robot has {len(robot_joints)} ({_listed(robot_joints)}). If the log covers part "
            "of the robot, load it with Robot.from_urdf(..., joints=[...]); if it has further "
            "joints, select the columns with columns={'q': [...], 'dq': [...], 'tau': [...]}. On "
            "the command line: --joints NAME,..; --columns 'q=...{i},dq=...{i},tau=...{i}'."
        )
    if n > max(len(names), MANY_JOINTS):
        raise LogError(
            f"{source} has a column of joint {n}, but only {len(names)} columns. Check its name; "
            "rename it, or select the columns with columns={'q': [...]}."
        )
    if "cmd" not in said_quantities:
        _leave_incomplete(match, "cmd", n, source)
    if not match.joint_names:
        match.joint_names = list(robot_joints or [str(k + 1) for k in range(n)])
    for target, name in match.columns.items():
        unit = split_unit(str(name))[1]
        if unit is not None:
            match.units[target] = (str(name), unit)
    return match


def _refuse_too_many(names: Sequence[str], source: str) -> None:
    """Refuse too many columns or too long names, which are due to damage or an attack."""
    if len(names) > MOST_COLUMNS:
        raise LogError(
            f"{source} has {len(names)} columns; at most {MOST_COLUMNS} are read. Store the "
            "columns that are needed."
        )
    long = next((name for name in names if len(name) > LONGEST_NAME), None)
    if long is not None:
        raise LogError(
            f"{source} has a column whose name has {len(long)} letters; at most {LONGEST_NAME} "
            f"are read. It begins with {long[:40]!r}; rename it."
        )


def _said(
    names: Sequence[str],
    columns: Mapping[str, str | int | Sequence[str | int]],
    robot_joints: Sequence[str] | None,
    source: str,
) -> dict[str, str]:
    """The user's mapping, as log name to source name."""
    said: dict[str, str] = {}
    joints = None if robot_joints is None else list(robot_joints)
    for target, value in columns.items():
        if re.sub(r"\d+$", "", target) not in SPELLINGS:
            raise LogError(
                f"columns: {target!r} is not a signal of a log; use "
                f"{', '.join((*KEYS, *PER_JOINT))}, or one joint of them such as 'q1'."
            )
        if target in PER_JOINT:
            if joints is None and isinstance(value, str) and "{joint}" in value:
                joints = _joints_of(value, names)  # the same order for the other quantities
            for k, name in enumerate(_expand(value, names, joints)):
                said[f"{target}{k + 1}"] = _existing(name, names, target, source)
        else:
            if not isinstance(value, (str, int)):
                raise LogError(f"columns: {target!r} takes one column, not {value!r}.")
            said[target] = _existing(value, names, target, source)
    return said


def _joints_of(value: str, names: Sequence[str]) -> list[str]:
    """Joints in the columns that match a pattern, in the order of the columns."""
    before, *after = map(re.escape, value.split("{joint}"))
    pattern = before + "(.+)" + r"\1".join(after)  # the same name at every position
    found = [hit[1] for name in names if (hit := re.fullmatch(pattern, name))]
    if not found:
        raise LogError(f"columns: no column matches {value!r}. There are: {_listed(names)}.")
    return found


def _expand(
    value: str | int | Sequence[str | int],
    names: Sequence[str],
    robot_joints: Sequence[str] | None,
) -> list[str | int]:
    if isinstance(value, int):
        return [value]
    if not isinstance(value, str):
        return list(value)
    if "{joint}" in value:
        return [value.replace("{joint}", joint) for joint in robot_joints or ()]
    value = value.replace("{i}", "{index}")
    if value not in names and any(f"{value}{k}" in names for k in (0, 1)):
        value += "{index}"  # a column of lists, which became one column per joint
    if "{index}" in value:
        known = set(names)
        first = 0 if value.replace("{index}", "0") in known else 1
        if robot_joints is not None:
            count = len(robot_joints)
        else:
            count = 0
            while value.replace("{index}", str(count + first)) in known:
                count += 1
        return [value.replace("{index}", str(k + first)) for k in range(max(count, 1))]
    return [value]


def _existing(value: str | int, names: Sequence[str], target: str, source: str) -> str:
    if isinstance(value, int) and not isinstance(value, bool):
        if not -len(names) <= value < len(names):
            raise LogError(
                f"columns: {target!r} is to be column {value}, but {source} has {len(names)}."
            )
        return names[value]
    if value in names:
        return str(value)
    raise LogError(
        f"columns: {target!r} is to be {value!r}, which is not in {source}"
        f"{suggest(value, names)}. It has: {_listed(names)}."
    )


def _guess(names: Sequence[str]) -> tuple[dict[str, _Found], dict[str, _Found]]:
    """Candidates by number and by joint name, per quantity, in the order of the columns."""
    by_index: dict[str, _Found] = {}
    by_joint: dict[str, _Found] = {}
    for name in names:
        quantity, index, joint = _parse(name)
        if quantity is None:
            continue
        if joint is not None:
            by_joint.setdefault(quantity, _Found()).add(joint, name)
        elif index is not None:
            by_index.setdefault(quantity, _Found()).add(index, name)
        elif quantity in KEYS:
            by_index.setdefault(quantity, _Found()).add(0, name)
    return by_index, by_joint


class _Found(dict[Any, str]):
    """Column of every joint, and further ones of the same signal."""

    def __init__(self) -> None:
        self.others: dict[Any, list[str]] = {}

    def add(self, joint: int | str, name: str) -> None:
        """Add a column; the first is used until a choice is needed."""
        if self.setdefault(joint, name) != name:
            self.others.setdefault(joint, []).append(name)

    def refuse_choice(self, quantity: str, source: str) -> None:
        """Raise if two columns are the same signal of one joint."""
        for joint, names in self.others.items():
            both = _listed([self[joint], *names])
            raise LogError(
                f"{source}: {both} are all {quantity} of joint {joint}. Select them with "
                f"columns={{'{quantity}': [...]}}, or remove the surplus ones."
            )


def _parse(name: str) -> tuple[str | None, int | None, str | None]:
    """Quantity, number and joint of a column name.

    >>> _parse("q1"), _parse("dq_elbow"), _parse("/joint_states/effort[0]")
    (('q', 1, None), ('dq', None, 'elbow'), ('tau', 0, None))
    >>> _parse("panda_joint1/position"), _parse("volts")
    (('q', None, 'panda_joint1'), (None, None, None))
    """
    parts = [part for part in re.split(r"[/.]", split_unit(name.strip())[0]) if part]
    if len(parts) > 1 and parts[-2].lower() == "observation":  # LeRobot: observation.state3
        parts = [*parts[:-2], f"{parts[-2]}_{parts[-1]}"]
    tail = parts[-1] if parts else ""
    words = tail.strip("[]")
    if _plain(words) in _QUANTITY_OF and not words[-1:].isdigit():
        quantity = _QUANTITY_OF[_plain(words)]
        # "panda_joint1/position" of flattened ROS messages: the joint is before the quantity
        if quantity not in KEYS and len(parts) > 1:
            return quantity, None, parts[-2]
        return quantity, None, None
    # a name that cannot end in a number is not searched for one, letter by letter
    ends = tail[:-1] if tail.endswith(("]", ")")) else tail
    numbered = ends[-1:].isdigit() and re.fullmatch(r"(.*?)[ _\-\[(]*(\d+)[\])]?", tail)
    if numbered and _plain(numbered[1]) in _QUANTITY_OF:
        quantity = _QUANTITY_OF[_plain(numbered[1])]
        return (quantity, int(numbered[2]), None) if quantity not in KEYS else (None, None, None)
    # "q_elbow", then "elbow_pos": the quantity is the longest known beginning or end
    pieces = re.split(r"([ _\-])", tail)
    for cut in range(len(pieces) - 2, 0, -2):
        head, rest = "".join(pieces[:cut]), "".join(pieces[cut + 1 :])
        quantity = _QUANTITY_OF.get(_plain(head), "time")
        if quantity not in KEYS and rest:
            return quantity, None, rest
    for cut in range(1, len(pieces) - 1, 2):
        head, rest = "".join(pieces[:cut]), "".join(pieces[cut + 1 :])
        quantity = _QUANTITY_OF.get(_plain(rest), "time")
        if quantity not in KEYS and head:
            return quantity, None, head
    return None, None, None


def quantity_of(name: str) -> str | None:
    """Quantity in the name of a column or of a file with one signal; None if there is none.

    >>> quantity_of("effort_3"), quantity_of("commands"), quantity_of("volts")
    ('tau', 'cmd', None)
    """
    return _parse(name)[0]


def is_signal(name: str) -> bool:
    """Whether a name is that of a signal without a joint or number.

    >>> is_signal("torques"), is_signal("torque_test"), is_signal("run1")
    (True, False, False)
    """
    quantity, index, joint = _parse(name)
    return quantity is not None and index is None and joint is None


def _plain(text: str) -> str:
    return re.sub(r"[^a-z0-9]", "", text.lower())


def _leave_incomplete(match: NameMatch, quantity: str, n: int, source: str) -> None:
    """Leave columns of an optional quantity under their own names unless all are there."""
    placed = {name for name in match.columns if re.fullmatch(rf"{quantity}\d+", name)}
    if placed and n and placed != {f"{quantity}{k + 1}" for k in range(n)}:
        own = [match.columns.pop(name) for name in sorted(placed)]
        match.notes.append(
            f"{source}: column(s) {_listed(own)} are not those of all {n} joints, and are kept "
            "under their own names"
        )


def _with_joints(
    found: Mapping[int, str],
    listed: Mapping[str, Sequence[str]],
    robot_joints: Sequence[str] | None,
    notes: list[str],
) -> dict[str, str] | None:
    """Numbered columns by the joints that their source lists; None if it lists no names of use.

    Names of which none belongs to a joint of the robot, or some to the joint at their own place,
    are taken in their order, which is noted.
    """
    shift = 1 if 0 in found else 0
    named: dict[str, str] = {}
    for index, column in sorted(found.items()):
        joints = listed.get(column, ())
        if not 1 <= index + shift <= len(joints):
            return None
        named[joints[index + shift - 1]] = column
    if len(named) < len(found):
        return None
    located = [] if robot_joints is None else list(_located(robot_joints, named).values())
    if robot_joints is None or all(located):
        return named
    in_place = [hit is None or hit == name for hit, name in zip(located, named, strict=False)]
    if len(named) != len(located) or not all(in_place):
        return named if any(located) else None
    note = (
        f"the joints that the log lists ({_listed(named)}) have other names in the description "
        f"({_listed(robot_joints)}); they are taken in their order"
    )
    if note not in notes:
        notes.append(note)
    return None


def _place_by_joint(
    match: NameMatch,
    quantity: str,
    found: Mapping[str, str],
    robot_joints: Sequence[str] | None,
    source: str,
) -> None:
    if robot_joints is None:
        if not match.joint_names:
            match.joint_names = list(found)
        for k, joint in enumerate(match.joint_names):
            if joint in found:
                match.columns[f"{quantity}{k + 1}"] = found[joint]
        return
    located = _located(robot_joints, found)
    missing = [joint for joint, hit in located.items() if hit is None]
    # a name such as "tau_cmd" contains no joint
    if len(missing) == len(robot_joints) and quantity != "q":
        return
    if missing:
        hint = suggest(missing[0], found, cutoff=0.5)
        raise LogError(
            f"{source} has no {quantity} of the joint(s) {_listed(missing)}{hint}; it has "
            f"{_listed(found)}. If the log covers part of the robot, load it with "
            "Robot.from_urdf(..., joints=[...]); if joints have other names, give "
            f"columns={{'{quantity}': [...]}} in the order of the robot (--joints and --columns on "
            "the command line)."
        )
    match.joint_names = list(robot_joints)
    used = set(located.values())
    for k, joint in enumerate(robot_joints):
        hit = located[joint]
        assert hit is not None
        match.columns[f"{quantity}{k + 1}"] = found[hit]
    guessed = {joint: found[hit] for joint, hit in located.items() if hit and hit != joint}
    if guessed:
        match.notes.append(
            f"{quantity}: column(s) {_listed(guessed.values())} taken for joint(s) "
            f"{_listed(guessed)}"
        )
    if left := [found[joint] for joint in found if joint not in used]:
        match.notes.append(
            f"{quantity}: column(s) {_listed(left)} belong to no joint of the robot and are kept "
            "under their own names"
        )


def _located(joints: Sequence[str], found: Mapping[str, str]) -> dict[str, str | None]:
    """Name of every joint in ``found``: the same, or the only similar one.

    Names are similar if they differ only in case, separators or the word joint.
    """
    known, alike = set(joints), dict[str, list[str]]()
    for name in found:
        if name not in known:
            alike.setdefault(_core(name), []).append(name)
    rivals = Counter(_core(joint) for joint in known if joint not in found)

    def locate(joint: str) -> str | None:
        if joint in found:
            return joint
        names = alike.get(core := _core(joint), [])
        return names[0] if len(names) == rivals[core] == 1 else None

    return {joint: locate(joint) for joint in joints}


def _core(joint: str) -> str:
    """Joint name without case, separators and the word joint, which loggers add or omit.

    >>> _core("shoulder_pan_joint") == _core("Shoulder-Pan")
    True
    """
    return _plain(joint).replace("joint", "")


def _number_of_joints(match: NameMatch) -> int:
    numbers = [
        int(hit[2])
        for name in match.columns
        if (hit := re.fullmatch(r"(q|dq|ddq|tau|i)(\d+)", name))
    ]
    return max(numbers, default=0)


def _listed(names: Iterable[str]) -> str:
    names = [str(name) for name in names]
    more = f", ... ({len(names)} in all)" if len(names) > 12 else ""
    return ", ".join(names[:12]) + more
