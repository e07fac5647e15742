# SPDX-License-Identifier: BSD-3-Clause
"""Downloads of openly licensed recordings from the places where their authors publish them."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._exceptions import LogError
from skidyn._optional import import_optional
from skidyn._writing import write_text
from skidyn.logs import read_log

if TYPE_CHECKING:
    import pandas as pd
    from sklearn.utils import Bunch

#: Speeds in rpm of the constant-speed runs, in both directions (``n`` in the names of files).
SCREW_SPEEDS = (1, 2, 4, 6, 8, 10, 13, 17, 20, 25, 30, 40, 50, 60, 70, 80, 90, 100, 120, 140, 160)
#: Torque at 100 % in N m, nominal torque of the motor of these drives.
SCREW_TORQUE = 9.84e-3
#: Force per volt that the authors of EMPS identified, N/V.
EMPS_GAIN = 35.15065188248547


@dataclass(frozen=True)
class _Recording:
    """Files of a recording below an address, their licence, and the reader of all of them."""

    url: str
    files: tuple[str, ...]
    licence: str
    read: Callable[[Sequence[Path]], pd.DataFrame]
    known: Mapping[str, float] = field(default_factory=dict)


def fetch_recording(
    name: str,
    *,
    data_home: str | os.PathLike[str] | None = None,
    url: str = "",
    files: Sequence[str] = (),
    sha256: Sequence[str] = (),
) -> Bunch:
    """Download an openly licensed recording from the place where its authors publish it.

    ``"emps"`` [1]_ is a prismatic axis with a ball screw, 25 s at 1 kHz; ``"panda_exciting"`` an
    excitation of a Franka Emika Panda of the University of Salerno, 24 s at 30 Hz, which is too
    slow for accelerations above a few hertz; ``"panda_gaz"`` [2]_ one without a hand, 28 s at 1
    kHz. ``"double_pendulum"`` [3]_ are runs of two backdrivable joints, 200 to 690 Hz; ``"xl330"``
    [4]_ are 16 runs of a Dynamixel servo that swings 0.49 kg at 0.1 m, about 200 Hz;
    ``"screw_drive"`` [5]_ are a worm drive (60:1, a hanging weight of 0.096 kg) at constant speeds
    and start-stop runs, measured at its motor. None is part of skidyn.

    Parameters
    ----------
    name : str
        One of these recordings.
    data_home : path, optional
        Folder to keep the files in; that of scikit-learn's data sets if None.
    url : str, default=""
        Another folder to download from; that of the authors' repository if empty.
    files : sequence of str, default=()
        Names of files; all of the recording if empty.
    sha256 : sequence of str, default=()
        Checksums that the files must have. If empty, those of the first download are kept beside
        the files and must match from then on.

    Returns
    -------
    Bunch
        ``frame``: DataFrame ``time`` (s), ``trajectory, q1 ..`` (rad or m), ``dq1 ..``, and
        ``tau1 ..`` (N m or N: joint torque sensors of the Pandas; drive readings of the pendulum;
        at the motor of the worm drive; voltage times the authors' gain of 35.15 N/V for EMPS) or,
        for the servo, ``i1`` (A), ``temp1`` (degrees Celsius), ``volts`` and ``enabled`` (0 while
        the motor is off); ``licence``; ``paths``. For the servo also ``load``, the known ``m g l``
        of 0.481 N m.

    Raises
    ------
    LogError
        There is no such recording, a checksum differs, or a file is not of this kind.
    ImportError
        pooch is not installed (``pip install skidyn[fetch]``).

    References
    ----------
    .. [1] A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS", Workshop on
       Nonlinear System Identification Benchmarks, 2019.
    .. [2] C. Gaz, M. Cognetti, A. Oliva, P. Robuffo Giordano, A. De Luca, "Dynamic identification
       of the Franka Emika Panda robot with retrieval of feasible parameters using penalty-based
       optimization", IEEE Robotics and Automation Letters 4(4), 2019.
    .. [3] F. Wiebe et al., "Open Source Dual-Purpose Acrobot and Pendubot Platform: Benchmarking
       Control Algorithms for Underactuated Robotics", IEEE Robotics & Automation Magazine, 2023.
    .. [4] M. Duclusaud et al., "Extended Friction Models for the Physics Simulation of Servo
       Actuators", 2024.
    .. [5] Z. Mablekos-Alexiou, L. da Cruz, C. Bergeles, "Friction-inclusive modeling of sliding
       contact transmission systems in robotics", IEEE Transactions on Robotics 37(4), 2021.

    Examples
    --------
    >>> from skidyn.datasets import fetch_recording
    >>> emps = fetch_recording("emps")  # doctest: +SKIP
    """
    from sklearn.utils import Bunch  # a second of imports that reading a robot does not need

    if name not in RECORDINGS:
        raise LogError(f"no recording {name!r}; there are {', '.join(RECORDINGS)}")
    recording = RECORDINGS[name]
    address, files = (url or recording.url).rstrip("/"), files or recording.files
    paths = [
        _retrieve(f"{address}/{file}", f"{name}_{file.replace('/', '_')}", data_home, checksum)
        for file, checksum in zip_longest(files, sha256)
    ]
    frame, told = recording.read(paths), list(map(str, paths))
    return Bunch(frame=frame, licence=recording.licence, paths=told, **recording.known)


def _read(**options: Any) -> Callable[[Sequence[Path]], pd.DataFrame]:
    return partial(read_log, check=False, **options)


def _read_gaz(paths: Sequence[Path]) -> pd.DataFrame:
    import pandas

    parts = {}
    for signal, path in zip(("q", "dq", "tau", "time"), paths, strict=True):
        try:
            text = path.read_text(encoding="utf-8").replace(",", " ")
            parts[signal] = np.loadtxt(text.splitlines(), ndmin=2)
        except ValueError as error:
            raise LogError(f"{path} is not a recording of this kind: {error}") from None
    time = parts.pop("time")[:, 0]
    for signal, values in parts.items():
        if values.shape != (len(time), 7):
            raise LogError(f"{signal} has shape {values.shape}; ({len(time)}, 7) is expected")
    columns = {f"{s}{j + 1}": v[:, j] for s, v in parts.items() for j in range(7)}
    return pandas.DataFrame({"time": time, "trajectory": 1} | columns)


def _each(read: Callable[[Path], pd.DataFrame]) -> Callable[[Sequence[Path]], pd.DataFrame]:
    """Reader of several files, each of which is a trajectory."""

    def read_all(paths: Sequence[Path]) -> pd.DataFrame:
        import pandas

        tables = [read(path).assign(trajectory=number) for number, path in enumerate(paths, 1)]
        return pandas.concat(tables, ignore_index=True)

    return read_all


def _drive_run(path: Path) -> pd.DataFrame:
    import pandas

    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    try:
        first = lines.index("ms;rpm;%") + 1
        # Some cells contain a remark after their number.
        rows = [
            [float(c.split()[0]) for c in line.split(";")[:3]] for line in lines[first:] if line
        ]
        values = np.array(rows, dtype=float).reshape(-1, 3)
    except (ValueError, IndexError) as error:
        raise LogError(f"{path} is not a recording of this kind: {error}") from None
    time, dq = values[:, 0] / 1000, values[:, 1] * np.pi / 30
    q = np.concatenate([[0.0], np.cumsum(np.diff(time) * (dq[1:] + dq[:-1]) / 2)])
    columns = {"time": time, "q1": q, "dq1": dq, "tau1": values[:, 2] / 100 * SCREW_TORQUE}
    run: pd.DataFrame = pandas.DataFrame(columns)
    return run


def _servo_run(path: Path) -> pd.DataFrame:
    import pandas

    try:
        entries = pandas.DataFrame(json.loads(path.read_text(encoding="utf-8"))["entries"])
        current = entries["load"].to_numpy()
        columns = {
            "time": entries["timestamp"],
            "q1": entries["position"],
            "dq1": entries["speed"],
            # milliampere, stored as unsigned 16 bit in the source
            "i1": ((current + 2**15) % 2**16 - 2**15) / 1000,
            "temp1": entries["temp"],
            "volts": entries["input_volts"],
            "enabled": entries["torque_enable"].astype(float),
        }
    except (KeyError, TypeError, ValueError) as error:
        raise LogError(f"{path} is not a recording of this kind: {error}") from None
    run: pd.DataFrame = pandas.DataFrame(columns)
    return run


def _retrieve(
    url: str, name: str, data_home: str | os.PathLike[str] | None, sha256: str | None
) -> Path:
    """Download once, and compare the file with its checksum from then on."""
    pooch = import_optional("pooch", extra="fetch")
    home = None if data_home is None else str(data_home)
    from sklearn.datasets import get_data_home

    folder = Path(get_data_home(home)) / "skidyn"
    note = folder / f"{name}.sha256"
    known = sha256 or (note.read_text(encoding="ascii").strip() if note.exists() else None)
    file = folder / name
    if not file.exists():
        pooch.retrieve(url, known_hash=None, fname=name, path=folder)
    found = hashlib.sha256(file.read_bytes()).hexdigest()
    if known is not None and found != known:
        raise LogError(
            f"{file} has the SHA-256 checksum {found}, not {known}. Remove the file to download it "
            "again; if the checksum stays, the source has changed."
        )
    write_text(note, found)
    return file


#: Addresses contain the commit of the files, so that their content cannot change.
RECORDINGS = {
    "emps": _Recording(
        "https://raw.githubusercontent.com/forgi86/sysid-neural-continuous/"
        "93afc131780fb1d5477472935a18ac8405683890/examples/EMPS/data",
        ("DATA_EMPS.mat",),
        "Apache-2.0",
        _read(columns={"time": "t", "q": "qm", "i": "vir"}, drive_gains=[EMPS_GAIN]),
    ),
    "panda_exciting": _Recording(
        "https://raw.githubusercontent.com/unisa-acg/inverse-dynamics-solver/"
        "73217267f30e3aaba229b63233c8fdb628ba156b/inverse_dynamics_interface_franka_inria/bagfiles",
        ("panda_exciting_trajectory.db3",),
        "BSD-3-Clause",
        _read(),
    ),
    "panda_gaz": _Recording(
        "https://raw.githubusercontent.com/marcocognetti/FrankaEmikaPandaDynModel/"
        "44f1ec8a615555eb3469ca9b0abd31ef863872b5/matlab/data/Exciting_Traj/Trajectory_1/rbt_log",
        tuple(f"exciting_traj_{x}.txt" for x in ("positions", "velocity", "torques", "time")),
        "GPL-3.0",
        _read_gaz,
    ),
    "double_pendulum": _Recording(
        "https://raw.githubusercontent.com/dfki-ric-underactuated-lab/double_pendulum/"
        "33b5db87afc0a3228b3e7ed10c83d885af73e995/"
        "data/experiment_records/design_C.0/20220914/sys_id",
        tuple(f"trajectory_{k:02d}.csv" for k in (0, 1, 2, 3, 4, 5, 6, 12, 13)),
        "BSD-3-Clause",
        _read(
            columns={"time": "time", "q": "pos_meas{i}", "dq": "vel_meas{i}", "tau": "tau_meas{i}"}
        ),
    ),
    "xl330": _Recording(
        "https://raw.githubusercontent.com/Rhoban/bam/"
        "af2260462471ff45ac18af159b1327ea51d8db15/bam/data.bak/raw",
        tuple(
            f"2026-01-15_10h{moment}.json"
            for moment in (
                *("28m10", "28m17", "28m24", "28m32", "28m42", "28m49", "28m57", "29m04"),
                *("29m14", "29m21", "29m29", "29m37", "29m47", "29m54", "30m02", "30m10"),
            )
        ),
        "Apache-2.0",
        _each(_servo_run),
        {"load": 0.49 * 9.81 * 0.1},
    ),
    "screw_drive": _Recording(
        "https://raw.githubusercontent.com/RViMLab/TRO2021-Dynamic-Modelling/"
        "a6f5ca9790b28c20bf9affc70af812c7d960d8c3/experiments/driveNo3",
        (
            *("start_stop/10.csv", "start_stop/200.csv"),
            *(f"steady_state/0.096kg/{way}{v}.csv" for v in SCREW_SPEEDS for way in ("", "n")),
            *("steady_state/0.096kg/180.csv", "steady_state/0.096kg/n180.csv"),
            *("steady_state/0.096kg/200.csv", "steady_state/0.096kg/n200.csv"),
        ),
        "MIT",
        _each(_drive_run),
    ),
}
