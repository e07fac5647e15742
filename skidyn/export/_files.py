# SPDX-License-Identifier: BSD-3-Clause
"""Files of an exported model, each with a side-car for omitted effects."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from skidyn._writing import writable, write_bytes, write_json
from skidyn.effects import Term
from skidyn.export._model import describe_term, name_term
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

PathLike = str | os.PathLike[str]

#: Layout of the side-car file; the same for every format.
SCHEMA = "skidyn.not_held/1"


def write_files(
    path: PathLike,
    content: str | bytes,
    model: RBDRegressor | Robot,
    left: Sequence[Term],
    reasons: Mapping[Term, str] | None = None,
) -> tuple[str, ...]:
    """Write a file and ``<path>.skidyn.json`` with the omitted effects, each in one step.

    The names of the omitted effects are returned, with the reason where one is given. If there are
    none, there is no side-car, and one of an earlier export is removed.
    """
    reasons = reasons or {}
    beside = Path(f"{os.fspath(path)}.skidyn.json")
    writable(beside)  # both or neither
    write_bytes(path, content.encode() if isinstance(content, str) else content)
    if isinstance(model, Robot) or not left:
        beside.unlink(missing_ok=True)
        return ()
    content_beside = {
        "schema": SCHEMA,
        "file": Path(path).name,
        "joints": list(model.robot_.joint_names),
        "not_held": [
            describe_term(model, term) | ({"reason": reasons[term]} if term in reasons else {})
            for term in left
        ],
    }
    write_json(beside, content_beside)
    return tuple(
        name_term(model.robot_, term) + (f" ({reasons[term]})" if term in reasons else "")
        for term in left
    )
