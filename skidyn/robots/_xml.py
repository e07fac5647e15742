# SPDX-License-Identifier: BSD-3-Clause
"""Read robot descriptions without trusting them."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from xml.parsers import expat

from skidyn._exceptions import RobotDescriptionError

#: Larger descriptions are refused; whole humanoids take 1 MB, their meshes are other files.
MAX_BYTES = 64 * 2**20

#: What the dynamics needs; pictures, collision shapes, drivers and simulator settings are left out.
_KEPT_IN_LINK = frozenset({"inertial"})
_KEPT_IN_JOINT = frozenset({"origin", "parent", "child", "axis", "limit", "dynamics", "mimic"})


def read_description(source: str | bytes | os.PathLike[str]) -> bytes:
    """Text of a description given as a path or as the text itself.

    Raises
    ------
    FileNotFoundError
        The source is a path and there is no such file.
    RobotDescriptionError
        The source is empty or too large.
    """
    if isinstance(source, bytes):
        data = source
    elif isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        data = source.lstrip("\ufeff").encode("utf-8", errors="surrogatepass")
    else:
        path = Path(source)
        if path.stat().st_size > MAX_BYTES:
            raise RobotDescriptionError(f"{path} has more than {MAX_BYTES} bytes; is it a URDF?")
        data = path.read_bytes()
    if len(data) > MAX_BYTES:
        raise RobotDescriptionError(f"The description has more than {MAX_BYTES} bytes.")
    if not data.strip():
        raise RobotDescriptionError("The description is empty; expected a URDF <robot> element.")
    return data


def parse_robot_element(data: bytes) -> ElementTree.Element:
    """Root element with only links and joints in it, free of anything a parser could expand.

    Raises
    ------
    RobotDescriptionError
        Not well-formed XML, a document type or entity declaration, or not a URDF.
    """
    _refuse_declarations(data)
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise RobotDescriptionError(f"The description is not well-formed XML: {error}.") from error
    if _local(root.tag) != "robot":
        hint = " Load MJCF and SDF models after converting them to URDF."
        raise RobotDescriptionError(
            f"The root element is <{_local(root.tag)}>; expected a URDF <robot>."
            + (hint if _local(root.tag) in ("mujoco", "sdf") else "")
        )
    if any("xacro" in element.tag for element in root.iter() if isinstance(element.tag, str)):
        raise RobotDescriptionError("The description holds xacro macros; expand them first: xacro.")
    for element in list(root):
        if element.tag == "link":
            _keep(element, _KEPT_IN_LINK)
        elif element.tag == "joint":
            _keep(element, _KEPT_IN_JOINT)
        else:
            root.remove(element)
    return root


def _refuse_declarations(data: bytes) -> None:
    """Stop at the first document type, before any entity of it could be expanded."""

    def refuse(*_: object) -> int:
        raise RobotDescriptionError(
            "The description declares a document type or entities, which could expand without end "
            "or read other files; a URDF needs none. Remove the <!DOCTYPE ...> part."
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


def _keep(element: ElementTree.Element, tags: frozenset[str]) -> None:
    for child in list(element):
        if child.tag not in tags:
            element.remove(child)


def _local(tag: str) -> str:
    return tag.rpartition("}")[2]
