# SPDX-License-Identifier: BSD-3-Clause
"""Recordings in skidyn's own archive format: one npz file with many labelled runs."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from skidyn._checks import warn_about_log
from skidyn._exceptions import LogError
from skidyn.logs._files import Channel, load_npz, table_from_arrays
from skidyn.logs._table import TableOptions, build_table

if TYPE_CHECKING:
    from sklearn.utils import Bunch

#: Arrays that describe runs, not samples.
PER_RUN = ("traj_name", "traj_label", "fs", "joint_names", "meta")


def load_recording(
    path: str | os.PathLike[str],
    run: int | str | Sequence[int | str] | None = None,
    *,
    drive_gains: Sequence[float] | None = None,
    missing: Literal["error", "drop"] = "drop",
) -> Bunch:
    """Load a recording with labelled runs.

    The archive holds ``t`` (s), ``q``, ``dq``, ``tau`` (or currents ``i``) of shape
    (n_samples, n_joints), further signals, ``traj`` (run of each sample), and per run
    ``traj_name``, ``traj_label`` (JSON) and ``fs`` (Hz). It is read without unpickling.

    Parameters
    ----------
    path : path
        The ``.npz`` file.
    run : int, str, sequence of them or None, default=None
        Numbers or names of the runs to take; all if None.
    drive_gains : sequence of float, N m/A or N/A, optional
        Torque per ampere of each joint, to compute torques from currents.
    missing : {"drop", "error"}, default="drop"
        Rows that the recording marks as unreadable (NaN): leave them out with a warning, or raise.

    Returns
    -------
    Bunch
        ``frame``: DataFrame ``time, trajectory, q1 .., dq1 .., tau1 ..`` and further signals;
        ``trajectory`` is the number of the run. ``labels``: dict from run number to its label
        (dict), with its ``name`` and ``rate`` (Hz); ``joint_names``; ``meta``: dict on the whole
        recording; ``notes``: derived or omitted data.

    Raises
    ------
    LogError
        The file is not such an archive, a run does not exist, or the log cannot be used.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from skidyn.logs import load_recording
    >>> folder = tempfile.TemporaryDirectory()
    >>> file = pathlib.Path(folder.name, "pendulum.npz")
    >>> t = np.arange(5) / 100
    >>> np.savez(file, t=t, q=t[:, None], dq=t[:, None], tau=t[:, None], traj=np.zeros(5, int),
    ...          traj_name=["swing"], traj_label=['{"load_kg": 0.5}'], joint_names=["pivot"])
    >>> recording = load_recording(file, "swing")
    >>> recording.labels[0]["load_kg"], recording.frame.shape
    (0.5, (5, 5))
    >>> folder.cleanup()
    """
    from sklearn.utils import Bunch  # its import takes a second and is needed only here

    file = Path(path)
    if not file.exists():
        raise LogError(f"{file}: no such file.")
    arrays = load_npz(file)
    absent = [name for name in ("t", "q", "traj") if name not in arrays]
    if absent:
        raise LogError(f"{file} lacks {', '.join(absent)}; it has {', '.join(arrays)}.")
    labels = _labels(arrays)
    chosen = _chosen_runs(run, labels, file)
    rows = np.isin(arrays["traj"], chosen)
    signals = {
        name: a[rows]
        for name, a in arrays.items()
        if name not in PER_RUN and a.ndim in (1, 2) and len(a) == len(rows)
    }
    joints = [str(name) for name in arrays.get("joint_names", [])]
    channel = Channel(file.name, table_from_arrays(signals), {"joint_names": joints})
    options = TableOptions(drive_gains=drive_gains, missing=missing)
    frame, match = build_table([channel], str(file), options)
    for note in match.notes:
        warn_about_log(note)
    frame.attrs = {"joint_names": match.joint_names, "notes": match.notes}
    meta = json.loads(str(arrays["meta"])) if "meta" in arrays else {}
    return Bunch(
        frame=frame,
        labels={k: labels[k] for k in chosen},
        joint_names=match.joint_names,
        meta=meta,
        notes=match.notes,
    )


def _labels(arrays: dict[str, np.ndarray]) -> dict[int, dict[str, Any]]:
    """Label of each run, from 0."""
    n = int(np.max(arrays["traj"])) + 1
    labels: dict[int, dict[str, Any]] = {}
    for k in range(n):
        label = json.loads(str(arrays["traj_label"][k])) if "traj_label" in arrays else {}
        label["name"] = str(arrays["traj_name"][k]) if "traj_name" in arrays else str(k)
        if "fs" in arrays:
            label["rate"] = float(arrays["fs"][k])
        labels[k] = label
    return labels


def _chosen_runs(
    run: int | str | Sequence[int | str] | None, labels: dict[int, dict[str, Any]], file: Path
) -> list[int]:
    if run is None:
        return list(labels)
    wanted = [run] if isinstance(run, (int, str)) else list(run)
    names = {label["name"]: k for k, label in labels.items()}
    chosen = []
    for item in wanted:
        k = names.get(item) if isinstance(item, str) else int(item)
        if k is None or k not in labels:
            raise LogError(f"{file} has no run {item!r}; it has {', '.join(names)}.")
        chosen.append(k)
    return chosen
