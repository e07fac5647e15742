# SPDX-License-Identifier: BSD-3-Clause
"""Read robot descriptions without trusting them."""

from __future__ import annotations

import os
import re
import shlex
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.parsers import expat

import numpy as np

from skidyn._exceptions import RobotDescriptionError

#: Larger descriptions are refused; that of a humanoid takes 1 MB, without its meshes.
MAX_BYTES = 64 * 2**20


def read_description(source: str | bytes | os.PathLike[str]) -> bytes:
    """Text of a description given as a path or as the text itself, neither empty nor too large."""
    if isinstance(source, bytes):
        data = source
    elif isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        data = source.lstrip("\ufeff").encode("utf-8", errors="surrogatepass")
    elif not isinstance(source, str | os.PathLike):
        raise RobotDescriptionError(
            f"{source!r} describes no robot; give the path of a URDF, its text, or a Robot"
        )
    else:
        path = Path(source)
        if path.stat().st_size > MAX_BYTES:
            raise RobotDescriptionError(f"{path} has more than {MAX_BYTES} bytes; is it a URDF?")
        data = path.read_bytes()
        if data.startswith(b"version https://git-lfs"):
            raise RobotDescriptionError(
                f"{path} is a Git LFS pointer instead of the file itself. Fetch it with: git lfs "
                f"pull --include={path.name}"
            )
    if len(data) > MAX_BYTES:
        raise RobotDescriptionError(f"The description has more than {MAX_BYTES} bytes.")
    if not data.strip():
        raise RobotDescriptionError("The description is empty; expected a URDF <robot> element.")
    return data


def is_text(source: str | bytes | os.PathLike[str]) -> bool:
    """Whether a source is the text of a description, not its path."""
    return isinstance(source, bytes) or str(source).lstrip("\ufeff \t\r\n").startswith("<")


def name_of(source: str | bytes | os.PathLike[str]) -> str:
    """Path of a description; a default one if the source is the text itself."""
    return "robot.urdf.xacro" if is_text(source) else os.fsdecode(source)


@contextmanager
def naming_file(source: str | bytes | os.PathLike[str]) -> Iterator[None]:
    """Begin errors of a description that was read from a file with its path."""
    try:
        yield
    except RobotDescriptionError as error:
        if not isinstance(source, str | os.PathLike) or is_text(source):
            raise
        path = os.fsdecode(source)
        if path in str(error):
            raise
        raise RobotDescriptionError(f"{path}: {error}") from error.__cause__


def first_element(data: bytes) -> str:
    """Name of the root element, which determines the format; empty if there is none."""
    text = re.sub(rb"<!--.*?-->|<\?.*?\?>", b"", data[:100_000], flags=re.DOTALL)
    hit = re.search(rb"<\s*([A-Za-z_][\w.-]*)", text)
    return hit[1].decode() if hit else ""


def parse_robot_element(data: bytes, path: str = "robot.urdf.xacro") -> ElementTree.Element:
    """Root element of a URDF, without anything that a parser could expand.

    A RobotDescriptionError with the path is raised for text that is not well-formed XML, has a
    document type or entity declaration, or is not a URDF.
    """
    root = parse_xml(data)
    if _local(root.tag) != "robot":
        reader = {"mujoco": "from_mjcf", "sdf": "from_sdf"}.get(_local(root.tag))
        raise RobotDescriptionError(
            f"The root element is <{_local(root.tag)}>; expected a URDF <robot>."
            + (f" Robot.{reader} reads it." if reader else "")
        )
    if any("xacro" in element.tag for element in root.iter() if isinstance(element.tag, str)):
        expanded = Path(path).name.removesuffix(".xacro").removesuffix(".urdf") + ".urdf"
        expanded = expanded if expanded != Path(path).name else f"expanded_{expanded}"
        raise RobotDescriptionError(
            f"The description contains xacro macros; expand them first: xacro {shlex.quote(path)} "
            f"> {shlex.quote(expanded)} (pip install xacro installs it without ROS)."
        )
    return root


def only(element: ElementTree.Element, tag: str, what: str) -> ElementTree.Element | None:
    """The only child with a tag, or None; a RobotDescriptionError if there are several."""
    found = element.findall(tag)
    if len(found) > 1:
        raise RobotDescriptionError(f"The {what} has {len(found)} <{tag}> elements; keep one.")
    return found[0] if found else None


def required(element: ElementTree.Element, tag: str, what: str) -> ElementTree.Element:
    """The child with a tag; a RobotDescriptionError if there is none, or several."""
    child = only(element, tag, what)
    if child is None:
        raise RobotDescriptionError(f"The {what} has no <{tag}>; add one.")
    return child


def word(element: ElementTree.Element, key: str, what: str) -> str:
    """A text attribute; a RobotDescriptionError if it is absent or empty."""
    value = element.get(key)
    if not value:
        raise RobotDescriptionError(f"The <{element.tag}> of {what} has no {key}; add {key}=...")
    return value


def numbers(
    element: ElementTree.Element,
    key: str,
    count: int,
    what: str,
    default: tuple[float, ...] | None = None,
) -> np.ndarray:
    """As many finite numbers of an attribute; without a default it must be there.

    ``what`` is the element to which they belong, for the message of the RobotDescriptionError.
    """
    text = element.get(key)
    if text is None:
        if default is None:
            raise RobotDescriptionError(f"{what[0].upper()}{what[1:]} has no {key}; add {key}=...")
        return np.array(default)
    return numbers_of(text, count, f"{what} ({key})")


def numbers_of(text: str, count: int, what: str) -> np.ndarray:
    """As many finite numbers, separated by white space; else a RobotDescriptionError."""
    expected = "a finite number" if count == 1 else f"{count} finite numbers"
    try:
        values = np.array([float(part) for part in text.split()])
    except ValueError:
        values = np.empty(0)
    if len(values) != count or not np.all(np.isfinite(values)):
        raise RobotDescriptionError(
            f"{what[0].upper()}{what[1:]} is {text[:80]!r}; expected {expected}."
        )
    return values


def parse_xml(data: bytes) -> ElementTree.Element:
    """Root element, without anything that a parser could expand.

    A RobotDescriptionError is raised for text that is not well-formed XML, and for a document type
    or entity declaration.
    """
    _refuse_declarations(data)
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise RobotDescriptionError(f"The description is not well-formed XML: {error}.") from error


def _refuse_declarations(data: bytes) -> None:
    """Raise an error at the first document type, before any entity can be expanded."""

    def refuse(*_: object) -> int:
        raise RobotDescriptionError(
            "The description declares a document type or entities, which could expand without "
            "bound or read other files; a URDF needs none. Remove the <!DOCTYPE ...> part."
        )

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        if isinstance(error, RobotDescriptionError):
            raise
        raise RobotDescriptionError(f"The description is not well-formed XML: {error}.") from error


def _local(tag: str) -> str:
    return tag.rpartition("}")[2]
