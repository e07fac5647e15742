# SPDX-License-Identifier: BSD-3-Clause
"""Computations, files and texts of the commands. No file is left incomplete."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from skidyn._exceptions import LogError
from skidyn._progress import listening
from skidyn._text import digits
from skidyn._writing import replacing

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.diagnosis import Comparison, Diagnosis
    from skidyn.identification import RBDRegressor
    from skidyn.measurement import Suspicion
    from skidyn.simulation import Controller


def run_diagnosis(
    model: Any,
    frame: Any,
    tau: Any,
    options: argparse.Namespace,
    kinds: Any = None,
    controller: Controller | None = None,
    checks: Sequence[Suspicion] | None = None,
) -> Diagnosis:
    from skidyn.diagnosis import Settings, diagnose

    wanted = getattr(options, "effects", None)
    if kinds is None and wanted:
        kinds = [kind.strip() for kind in wanted.split(",")]
    # Without kinds there is no search: the model is only compared.
    settings = Settings(max_findings=0) if kinds == () else Settings()
    rate = getattr(options, "rate", None)
    # suspicions about a log do not stop a comparison, only conclusions from it
    force = kinds == () or bool(getattr(options, "force", False))
    with working("Comparing" if kinds == () else "Searching for what is missing", options):
        return diagnose(
            model,
            frame,
            None if controller is not None and "tau1" not in frame else tau,
            effects=kinds,
            rate=rate,
            settings=settings,
            force=force,
            n_jobs=getattr(options, "jobs", -1),
            controller=controller,
            checks=checks,
        )


def explain_motion(diagnosis: Diagnosis, frame: Any, options: argparse.Namespace) -> None:
    """Identify effects from the motion under a controller; nothing without a controller."""
    controller = diagnosis.controller
    if controller is None:
        return
    if "tau1" not in frame:
        diagnosis.warnings.insert(0, _torque_told(controller, len(diagnosis.joint_names)))
    with working("Simulating the servos", options):
        try:
            diagnosis.explain_servo_motion()
        except LogError as error:
            diagnosis.warnings.append(f"The motion of the servos was not analysed: {error}.")


def _torque_told(controller: Controller, n_joints: int) -> str:
    """Source of the torque for a log without torque."""
    gains = [digits(gain) for gain in controller.checked(n_joints).stiffness]
    shown = gains[0] if len(set(gains)) == 1 else ", ".join(gains)
    late = f", {1e3 * controller.delay:.3g} ms late" if controller.delay else ""
    return (
        f"The torque is computed from the servos as gain times position error{late}: {shown} N "
        "m/rad (N/m for sliders)."
    )


def write_page(diagnosis: Diagnosis, html: str, provenance: dict[str, Any]) -> None:
    from skidyn.report import summarize, write_html

    write_html(html, summarize(diagnosis, provenance=provenance))


def write_table(frame: pd.DataFrame, path: str) -> None:
    """Write a log in one step, so that an interrupted run leaves the previous file unchanged."""
    write = frame.to_parquet if Path(path).suffix == ".parquet" else frame.to_csv
    with replacing(path) as part:
        write(part, index=False)


@contextmanager
def working(text: str, options: argparse.Namespace) -> Iterator[None]:
    """Show the progress of a long computation in a terminal if rich is installed."""
    if getattr(options, "json", False) or not sys.stderr.isatty():
        yield
        return
    try:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            Progress,
            SpinnerColumn,
            TaskProgressColumn,
            TextColumn,
            TimeElapsedColumn,
        )
    except ImportError:
        print(f"{text} ...", file=sys.stderr)
        yield
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(text, total=None)

        def move(told: str, share: float | None) -> None:
            total = None if share is None else 1.0
            progress.update(task, description=told, total=total, completed=share or 0.0)

        with listening(move):
            yield


def print_suspicions(checks: Sequence[Suspicion], where: str = "the log") -> None:
    """Print suspicions about a log above the result."""
    from skidyn.measurement import paragraphs

    if checks:
        print(f"Check {where} first:")
        print("\n".join(f"  {line}" for line in paragraphs(checks)), end="\n\n")


#: Options in a report, with the permitted types, since a report may be untrusted.
RECORDED: dict[str, tuple[type, ...]] = {
    "logs": (list,),
    "urdf": (str,),
    "model": (str,),
    "nominal": (bool,),
    "rate": (float, int, type(None)),
    **dict.fromkeys(("columns", "units", "drive_gains", "joints", "effects"), (str, type(None))),
    **dict.fromkeys(("gravity", "flip", "order", "combine", "gain"), (str, type(None))),
    "summed": (str, type(None)),
    **dict.fromkeys(("zero", "late", "lowpass", "derive", "placeholder"), (str, type(None))),
    **dict.fromkeys(("torque_sign", "clock", "missing", "topics"), (str, type(None))),
    **dict.fromkeys(
        ("unwrap", "drop_repeated", "split_leaps", "restore_gravity", "force"), (bool, type(None))
    ),
    "resample": (float, int, type(None)),
    "controller": (str, type(None)),
}


def provenance(options: argparse.Namespace, notes: Sequence[str] = ()) -> dict[str, Any]:
    """Versions, files and options of a result, and notes on what was changed in the log."""
    from skidyn._version import versions

    recorded = {name: getattr(options, name, None) for name in RECORDED}
    digests = hashes([*options.logs, options.urdf])
    told = {"versions": versions(), "sha256": digests, "options": recorded}
    return {**told, "notes": list(notes)} if notes else told


def hashes(files: Sequence[str]) -> dict[str, str]:
    """SHA-256 of every existing file, and one for all logs of a folder or a pattern."""
    import hashlib

    from skidyn.logs import files_of

    digests = {}
    for name in files:
        parts = files_of(name)
        own = []
        for part in parts:
            with part.open("rb") as file:
                own.append(hashlib.file_digest(file, "sha256").hexdigest())
        if parts == [Path(name)]:
            digests[name] = own[0]
        elif own:
            digests[name] = hashlib.sha256("".join(own).encode()).hexdigest()
    return digests


def parameters(model: RBDRegressor) -> dict[str, Any]:
    return {
        "schema": "skidyn.parameters/1",
        "joints": list(model.robot_.joint_names),
        "coefficients": model.parameter_table(),
        "base_parameters": model.base_parameters_,
        "inertial_parameters": model.inertial_parameters_.tolist(),
        "effects": [
            {
                "kind": term.kind,
                "joints": list(term.joints),
                "shape": dict(term.shape),
                "coefficients": model.effect_coefficients_[term].tolist(),
            }
            for term in model.effect_terms_
        ],
        "noise_std": model.noise_std_.tolist(),
        "condition_number": model.condition_number_,
        "open_combinations": model.open_combinations(),
        "essential_parameters": model.essential_parameters(),
    }


def rmse_per_joint(model: Any, X: Any, y: Any, use: Any = None) -> Any:
    import numpy as np

    square = (np.asarray(model.predict(X)) - np.asarray(y)) ** 2
    return np.sqrt(np.average(square, axis=0, weights=use))


def print_json(content: Any) -> None:
    from skidyn._plain import plain

    print(json.dumps(plain(content), indent=2))


def print_comparison(comparison: Comparison) -> None:
    print(
        "error by joint and trajectory, on all samples, and as a share of the torque "
        "(root mean squares in N m, N for sliders)"
    )
    for row in comparison.table():
        print(
            f"  {row['name']:24s} trajectory {row['trajectory']:4d} "
            f"{row['rmse']:9.4g}  {row['relative']:6.1%}"
        )


def print_regimes(diagnosis: Diagnosis) -> None:
    import numpy as np

    print("error by joint and regime (N m, N for sliders)")
    width = max(len(name) for name in diagnosis.joint_names)
    cells = [["-" if np.isnan(e) else digits(e) for e in own] for own in diagnosis.error_map()]
    columns = zip(diagnosis.regimes, *cells, strict=True)
    widths = [max(8, 1 + max(map(len, own))) for own in columns]  # seven fit into 80 columns
    for name, own in zip(["", *diagnosis.joint_names], [diagnosis.regimes, *cells], strict=True):
        row = "".join(f"{cell:>{w}s}" for cell, w in zip(own, widths, strict=True))
        print(f"  {name:{width}s}{row}")
    for failure in diagnosis.failures:
        print(f"  {failure.sentence}")
    if not diagnosis.failures:
        print("  No joint has an error above its noise.")
