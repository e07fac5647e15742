# SPDX-License-Identifier: BSD-3-Clause
"""Downloads of openly licensed recordings from the places where their authors publish them."""

from __future__ import annotations

import hashlib
import json
import os
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

#: Addresses contain the commit of the files, so that their content cannot change.
EMPS_URL = (
    "https://raw.githubusercontent.com/forgi86/sysid-neural-continuous/"
    "93afc131780fb1d5477472935a18ac8405683890/examples/EMPS/data/DATA_EMPS.mat"
)
PANDA_URL = (
    "https://raw.githubusercontent.com/unisa-acg/inverse-dynamics-solver/"
    "73217267f30e3aaba229b63233c8fdb628ba156b/"
    "inverse_dynamics_interface_franka_inria/bagfiles/panda_exciting_trajectory.db3"
)
GAZ_URL = (
    "https://raw.githubusercontent.com/marcocognetti/FrankaEmikaPandaDynModel/"
    "44f1ec8a615555eb3469ca9b0abd31ef863872b5/matlab/data/Exciting_Traj/Trajectory_1/rbt_log/"
)
PENDULUM_URL = (
    "https://raw.githubusercontent.com/dfki-ric-underactuated-lab/double_pendulum/"
    "33b5db87afc0a3228b3e7ed10c83d885af73e995/"
    "data/experiment_records/design_C.0/20220914/sys_id/"
)
PENDULUM_RUNS = tuple(f"trajectory_{k:02d}.csv" for k in (0, 1, 2, 3, 4, 5, 6, 12, 13))
XL330_URL = (
    "https://raw.githubusercontent.com/Rhoban/bam/"
    "af2260462471ff45ac18af159b1327ea51d8db15/bam/data.bak/raw/"
)
XL330_RUNS = tuple(
    f"2026-01-15_10h{moment}.json"
    for moment in (
        *("28m10", "28m17", "28m24", "28m32", "28m42", "28m49", "28m57", "29m04"),
        *("29m14", "29m21", "29m29", "29m37", "29m47", "29m54", "30m02", "30m10"),
    )
)
SCREW_URL = (
    "https://raw.githubusercontent.com/RViMLab/TRO2021-Dynamic-Modelling/"
    "a6f5ca9790b28c20bf9affc70af812c7d960d8c3/experiments/driveNo3/"
)
#: Speeds in rpm of the constant-speed runs, in both directions (``n`` in the names of files).
SCREW_SPEEDS = (1, 2, 4, 6, 8, 10, 13, 17, 20, 25, 30, 40, 50, 60, 70, 80, 90, 100, 120, 140, 160)
SCREW_RUNS = (
    *("start_stop/10.csv", "start_stop/200.csv"),
    *(f"steady_state/0.096kg/{way}{v}.csv" for v in SCREW_SPEEDS for way in ("", "n")),
    *("steady_state/0.096kg/180.csv", "steady_state/0.096kg/n180.csv"),
    *("steady_state/0.096kg/200.csv", "steady_state/0.096kg/n200.csv"),
)
#: Torque at 100 % in N m, nominal torque of the motor of these drives.
SCREW_TORQUE = 9.84e-3
#: Force per volt that the authors of EMPS identified, N/V.
EMPS_GAIN = 35.15065188248547


def _bunch(**fields: Any) -> Bunch:
    from sklearn.utils import Bunch  # a second of imports that reading a robot does not need

    return Bunch(**fields)


def fetch_emps(
    *, data_home: str | os.PathLike[str] | None = None, sha256: str | None = None, url: str = ""
) -> Bunch:
    """Download the EMPS benchmark: one prismatic axis with a ball screw, 25 s at 1 kHz.

    The recording is that of [1]_ as kept in the repository forgi86/sysid-neural-continuous, whose
    licence is Apache-2.0. It is not part of skidyn.

    Parameters
    ----------
    data_home : path, optional
        Folder to keep the file in; that of scikit-learn's data sets if None.
    sha256 : str, optional
        Checksum that the file must have. If None, that of the first download is kept beside the
        file and must match from then on.
    url : str, default=""
        Another place to download from; the repository named above if empty.

    Returns
    -------
    Bunch
        ``frame``: DataFrame ``time`` (s), ``trajectory, q1`` (m), ``dq1`` (m/s, derived from the
        positions), ``tau1`` (N, voltage times the authors' gain of 35.15 N/V); ``licence``,
        ``path``.

    Raises
    ------
    LogError
        The checksum differs.
    ImportError
        pooch is not installed (``pip install skidyn[fetch]``).

    References
    ----------
    .. [1] A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS", Workshop on
       Nonlinear System Identification Benchmarks, 2019.

    Examples
    --------
    >>> from skidyn.datasets import fetch_emps
    >>> emps = fetch_emps()  # doctest: +SKIP
    """
    path = _retrieve(url or EMPS_URL, "emps.mat", data_home, sha256)
    columns = {"time": "t", "q": "qm", "i": "vir"}
    frame = read_log(path, columns=columns, drive_gains=[EMPS_GAIN], check=False)
    return _bunch(frame=frame, licence="Apache-2.0", path=str(path))


def fetch_panda_exciting(
    *, data_home: str | os.PathLike[str] | None = None, sha256: str | None = None, url: str = ""
) -> Bunch:
    """Download an excitation of a Franka Emika Panda: 7 joints, 24 s at 30 Hz.

    The recording is a ROS 2 bag of the repository unisa-acg/inverse-dynamics-solver, whose licence
    is BSD-3-Clause. It is not part of skidyn. It is too slow for accelerations above a few hertz.

    Parameters
    ----------
    data_home : path, optional
        Folder to keep the file in; that of scikit-learn's data sets if None.
    sha256 : str, optional
        Checksum that the file must have. If None, that of the first download is kept beside the
        file and must match from then on.
    url : str, default=""
        Another place to download from; the repository named above if empty.

    Returns
    -------
    Bunch
        ``frame``: DataFrame ``time`` (s), ``trajectory, q1 .. q7`` (rad), ``dq1 .. dq7``,
        ``tau1 .. tau7`` (N m, joint torque sensors); ``licence``, ``path``.

    Raises
    ------
    LogError
        The checksum differs.
    ImportError
        pooch is not installed (``pip install skidyn[fetch]``).

    Examples
    --------
    >>> from skidyn.datasets import fetch_panda_exciting
    >>> panda = fetch_panda_exciting()  # doctest: +SKIP
    """
    path = _retrieve(url or PANDA_URL, "panda_exciting.db3", data_home, sha256)
    return _bunch(frame=read_log(path, check=False), licence="BSD-3-Clause", path=str(path))


def fetch_double_pendulum(
    *, data_home: str | os.PathLike[str] | None = None, url: str = "", runs: tuple[str, ...] = ()
) -> Bunch:
    """Download identification runs of a double pendulum: two backdrivable joints, 200 to 690 Hz.

    The recordings are those of design C.0 of 14 September 2022 in the repository
    dfki-ric-underactuated-lab/double_pendulum [1]_, whose licence is BSD-3-Clause. They are not
    part of skidyn.

    Parameters
    ----------
    data_home : path, optional
        Folder to keep the files in; that of scikit-learn's data sets if None.
    url : str, default=""
        Another folder to download from; that of the repository if empty.
    runs : tuple of str, default=()
        Names of files; all nine if empty.

    Returns
    -------
    Bunch
        ``frame``: DataFrame ``time`` (s), ``trajectory, q1, q2`` (rad), ``dq1, dq2``,
        ``tau1, tau2`` (N m, drive reading); ``licence``, ``paths``.

    Raises
    ------
    LogError
        A file's checksum is not that of its first download.
    ImportError
        pooch is not installed (``pip install skidyn[fetch]``).

    References
    ----------
    .. [1] F. Wiebe et al., "Open Source Dual-Purpose Acrobot and Pendubot Platform: Benchmarking
       Control Algorithms for Underactuated Robotics", IEEE Robotics & Automation Magazine, 2023.

    Examples
    --------
    >>> from skidyn.datasets import fetch_double_pendulum
    >>> pendulum = fetch_double_pendulum()  # doctest: +SKIP
    """
    address = url or PENDULUM_URL
    paths = [
        _retrieve(f"{address.rstrip('/')}/{run}", f"double_pendulum_{run}", data_home, None)
        for run in runs or PENDULUM_RUNS
    ]
    columns = {
        "time": "time",
        "q": ["pos_meas1", "pos_meas2"],
        "dq": ["vel_meas1", "vel_meas2"],
        "tau": ["tau_meas1", "tau_meas2"],
    }
    frame = read_log(paths, columns=columns, check=False)
    return _bunch(frame=frame, licence="BSD-3-Clause", paths=[str(p) for p in paths])


def fetch_xl330(
    *, data_home: str | os.PathLike[str] | None = None, url: str = "", runs: tuple[str, ...] = ()
) -> Bunch:
    """Download a servo that swings 0.49 kg at 0.1 m: 16 runs of a Dynamixel XL330 at about 200 Hz.

    The recordings are those of [1]_ in the history of the repository Rhoban/bam, whose licence is
    Apache-2.0. They are not part of skidyn.

    Parameters
    ----------
    data_home : path, optional
        Folder to keep the files in; that of scikit-learn's data sets if None.
    url : str, default=""
        Another folder to download from; that of the repository if empty.
    runs : tuple of str, default=()
        Names of files; all sixteen if empty.

    Returns
    -------
    Bunch
        ``frame``: DataFrame ``time`` (s), ``trajectory, q1`` (rad, zero hanging down), ``dq1``
        (rad/s), ``i1`` (A), ``temp1`` (degrees Celsius), ``volts``, ``enabled`` (0 while the motor
        is off); ``load``: the known ``m g l`` of 0.481 N m; ``licence``, ``paths``.

    Raises
    ------
    LogError
        A file's checksum is not that of its first download, or it is not a recording of this kind.
    ImportError
        pooch is not installed (``pip install skidyn[fetch]``).

    References
    ----------
    .. [1] M. Duclusaud et al., "Extended Friction Models for the Physics Simulation of Servo
       Actuators", 2024.

    Examples
    --------
    >>> from skidyn.datasets import fetch_xl330
    >>> servo = fetch_xl330()  # doctest: +SKIP
    """
    import pandas

    address = url or XL330_URL
    paths, tables = [], []
    for number, run in enumerate(runs or XL330_RUNS, 1):
        path = _retrieve(f"{address.rstrip('/')}/{run}", f"xl330_{run}", data_home, None)
        paths.append(str(path))
        tables.append(_servo_run(path).assign(trajectory=number))
    frame = pandas.concat(tables, ignore_index=True)
    return _bunch(frame=frame, load=0.49 * 9.81 * 0.1, licence="Apache-2.0", paths=paths)


def fetch_panda_gaz(*, data_home: str | os.PathLike[str] | None = None, url: str = "") -> Bunch:
    """Download an excitation of a Franka Emika Panda without a hand: 7 joints, 28 s at 1 kHz.

    The recording is that of [1]_ in the repository marcocognetti/FrankaEmikaPandaDynModel, whose
    licence is GPL-3.0. It is not part of skidyn.

    Parameters
    ----------
    data_home : path, optional
        Folder to keep the files in; that of scikit-learn's data sets if None.
    url : str, default=""
        Another folder to download from; that of the repository if empty.

    Returns
    -------
    Bunch
        ``frame``: DataFrame ``time`` (s), ``trajectory, q1 .. q7`` (rad), ``dq1 .. dq7``,
        ``tau1 .. tau7`` (N m, joint torque sensors); ``licence``, ``paths``.

    Raises
    ------
    LogError
        A file's checksum is not that of its first download, or the files do not fit together.
    ImportError
        pooch is not installed (``pip install skidyn[fetch]``).

    References
    ----------
    .. [1] C. Gaz, M. Cognetti, A. Oliva, P. Robuffo Giordano, A. De Luca, "Dynamic identification
       of the Franka Emika Panda robot with retrieval of feasible parameters using penalty-based
       optimization", IEEE Robotics and Automation Letters 4(4), 2019.

    Examples
    --------
    >>> from skidyn.datasets import fetch_panda_gaz
    >>> panda = fetch_panda_gaz()  # doctest: +SKIP
    """
    import pandas

    address = (url or GAZ_URL).rstrip("/")
    paths, parts = [], {}
    for signal, name in {"q": "positions", "dq": "velocity", "tau": "torques", "": "time"}.items():
        file = f"exciting_traj_{name}.txt"
        path = _retrieve(f"{address}/{file}", f"panda_gaz_{name}.txt", data_home, None)
        paths.append(str(path))
        try:
            text = path.read_text(encoding="utf-8").replace(",", " ")
            values = np.loadtxt(text.splitlines(), ndmin=2)
        except ValueError as error:
            raise LogError(f"{path} is not a recording of this kind: {error}") from None
        parts[signal] = values
    time = parts.pop("")[:, 0]
    for signal, values in parts.items():
        if values.shape != (len(time), 7):
            raise LogError(f"{signal} has shape {values.shape}; ({len(time)}, 7) is expected")
    columns = {f"{s}{j + 1}": v[:, j] for s, v in parts.items() for j in range(7)}
    frame = pandas.DataFrame({"time": time, "trajectory": 1} | columns)
    return _bunch(frame=frame, licence="GPL-3.0", paths=paths)


def fetch_screw_drive(
    *, data_home: str | os.PathLike[str] | None = None, url: str = "", runs: tuple[str, ...] = ()
) -> Bunch:
    """Download a worm drive at constant speeds and in start-stop runs, measured at its motor.

    The recordings are those of drive 3 (worm 60:1, a hanging weight of 0.096 kg) of [1]_ in the
    repository RViMLab/TRO2021-Dynamic-Modelling, whose licence is MIT. They are not part of skidyn.

    Parameters
    ----------
    data_home : path, optional
        Folder to keep the files in; that of scikit-learn's data sets if None.
    url : str, default=""
        Another folder to download from; that of the repository if empty.
    runs : tuple of str, default=()
        Names of files; all if empty.

    Returns
    -------
    Bunch
        ``frame``: DataFrame ``time`` (s), ``trajectory, q1`` (rad, integrated from the velocity),
        ``dq1`` (rad/s), ``tau1`` (N m at the motor); ``licence``, ``paths``.

    Raises
    ------
    LogError
        A file's checksum is not that of its first download, or it is not a recording of this kind.
    ImportError
        pooch is not installed (``pip install skidyn[fetch]``).

    References
    ----------
    .. [1] Z. Mablekos-Alexiou, L. da Cruz, C. Bergeles, "Friction-inclusive modeling of sliding
       contact transmission systems in robotics", IEEE Transactions on Robotics 37(4), 2021.

    Examples
    --------
    >>> from skidyn.datasets import fetch_screw_drive
    >>> drive = fetch_screw_drive()  # doctest: +SKIP
    """
    import pandas

    address = url or SCREW_URL
    paths, tables = [], []
    for number, run in enumerate(runs or SCREW_RUNS, 1):
        name = "screw_drive_" + run.replace("/", "_")
        path = _retrieve(f"{address.rstrip('/')}/{run}", name, data_home, None)
        paths.append(str(path))
        tables.append(_drive_run(path).assign(trajectory=number))
    frame = pandas.concat(tables, ignore_index=True)
    return _bunch(frame=frame, licence="MIT", paths=paths)


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
