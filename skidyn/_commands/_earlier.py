# SPDX-License-Identifier: BSD-3-Clause
"""Diagnoses of earlier commands, so that later ones need not repeat their checks and searches.

``skidyn diagnose`` stores them with its answer. They are used for the same question only: the same
log, robot, options and code. Those with a controller or with another clock than was asked for are
not used: the later commands judge the log as it is.
"""

from __future__ import annotations

import argparse
import warnings
from base64 import b64decode, b64encode
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from skidyn._commands._kept import Kept
from skidyn._commands._output import RECORDED
from skidyn._exceptions import LogWarning

if TYPE_CHECKING:
    from skidyn._signals import Array
    from skidyn.diagnosis import Comparison, Diagnosis
    from skidyn.measurement import Suspicion

#: Samples times joints of the largest comparison that is stored, in 42 bytes each.
LARGEST = 300_000
#: Stored arrays of the motion, and of the comparison; nothing else of them is compared.
MOTION = ("q", "dq", "trajectory", "time", "temperature", "prismatic", "load")
TORQUES = ("measured", "predicted", "sliding", "judged")


@dataclass(frozen=True)
class Finding:
    """What a comparison uses of a finding, under the names that it has there."""

    kind: str
    title: str
    joints: tuple[int, ...]
    rivals: tuple[str, ...]
    error_drop: float
    told: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """As in the report file."""
        return self.told


@dataclass(frozen=True)
class Earlier:
    """What a comparison uses of a diagnosis, under the names that it has there."""

    verdict: str
    joint_names: tuple[str, ...]
    findings: list[Finding]
    comparison: Comparison
    regimes: tuple[str, ...]
    rmse_before: Array
    rmse_after: Array
    noise: Array
    warnings: list[str]
    base_model: Any
    data: tuple[Any, ...]
    told: dict[str, Any]

    def story(self) -> dict[str, Any]:
        """Content of the first screen of the report."""
        return self.told

    def error_map(self) -> Array:
        """Error by joint and regime."""
        from skidyn.diagnosis import error_map

        return error_map(self.comparison)


def stored(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """What is stored of a diagnosis beside its report and story; None of a very long log."""
    comparison = diagnosis.comparison
    if comparison.measured.size > LARGEST:
        return None
    return {
        "titles": [finding.title for finding in diagnosis.findings],
        **{name: _packed(getattr(comparison.signals, name)) for name in MOTION},
        **{name: _packed(getattr(comparison, name)) for name in TORQUES},
    }


def earlier_checks(options: argparse.Namespace) -> list[Suspicion] | None:
    """Suspicions of an earlier diagnosis about the log of the options; None without one."""
    from skidyn.measurement import Remedy, Suspicion

    answer = _answer(options)
    if answer is None:
        return None
    checks = []
    for told in answer["report"]["checks"]:
        remedy = told["remedy"] and Remedy(**told["remedy"])
        checks.append(Suspicion(**{**told, "joints": tuple(told["joints"]), "remedy": remedy}))
    return checks


def earlier_diagnosis(
    options: argparse.Namespace, model: Any, frame: Any, tau: Any
) -> Earlier | None:
    """An earlier diagnosis of a model and log that were read with the options; None without one.

    Its warnings are given again.
    """
    import numpy as np

    from skidyn._signals import Signals
    from skidyn.diagnosis import REGIMES, Comparison
    from skidyn.identification import RBDRegressor

    answer = _answer(options) if isinstance(model, RBDRegressor) else None
    if answer is None or answer["compared"] is None:
        return None
    for note in answer["noted"]:
        warnings.warn(note, LogWarning, stacklevel=2)
    report, kept = answer["report"], answer["compared"]
    motion, torques = (
        {name: _unpacked(kept[name]) for name in group} for group in (MOTION, TORQUES)
    )
    signals = Signals(**motion, ddq=np.zeros_like(motion["q"]), robot=model.robot)
    names = tuple(report["joints"])
    findings = [
        Finding(
            told["kind"], title, tuple(told["joints"]), tuple(told["rivals"]), told["error_drop"],
            told,
        )
        for told, title in zip(report["effects"], kept["titles"], strict=True)
    ]  # fmt: skip
    return Earlier(
        verdict=report["verdict"],
        joint_names=names,
        findings=findings,
        comparison=Comparison(signals, **torques, joint_names=names),
        regimes=REGIMES,
        rmse_before=np.array(report["rmse_before"]),
        rmse_after=np.array(report["rmse_after"]),
        noise=np.array(report["noise_floor"]),
        warnings=report["warnings"],
        base_model=model,
        data=(frame, tau),
        told=answer["story"],
    )


def _answer(options: argparse.Namespace) -> dict[str, Any] | None:
    """The stored answer to the question that the options were, or would have been."""
    asked = {name: getattr(options, name, None) for name in RECORDED}
    answer = Kept(argparse.Namespace(**asked, simulate=False, no_cache=False)).read()
    return answer if answer and answer["of_the_log"] else None


def _packed(array: Any) -> dict[str, Any] | None:
    """An array with its order in memory, on which the last digits of sums depend."""
    if array is None:
        return None
    order = "F" if array.strides[0] < array.strides[-1] else "C"
    content = b64encode(array.tobytes(order)).decode("ascii")
    return {"dtype": array.dtype.str, "shape": array.shape, "order": order, "bytes": content}


def _unpacked(packed: dict[str, Any] | None) -> Any:
    import numpy as np

    if packed is None:
        return None
    flat = np.frombuffer(b64decode(packed["bytes"]), packed["dtype"])
    return flat.reshape(packed["shape"], order=packed["order"])
