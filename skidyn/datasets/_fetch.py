# SPDX-License-Identifier: BSD-3-Clause
"""Downloads of openly licensed recordings from the places where their authors publish them."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from sklearn.datasets import get_data_home
from sklearn.utils import Bunch

from skidyn._exceptions import LogError
from skidyn._optional import import_optional
from skidyn.datasets._log import read_log

#: Files are named by the commit that holds them, so that their content cannot change.
EMPS_URL = (
    "https://raw.githubusercontent.com/forgi86/sysid-neural-continuous/"
    "93afc131780fb1d5477472935a18ac8405683890/examples/EMPS/data/DATA_EMPS.mat"
)
PANDA_URL = (
    "https://raw.githubusercontent.com/unisa-acg/inverse-dynamics-solver/"
    "73217267f30e3aaba229b63233c8fdb628ba156b/"
    "inverse_dynamics_interface_franka_inria/bagfiles/panda_exciting_trajectory.db3"
)
#: Force per volt that the authors of EMPS identified, N/V.
EMPS_GAIN = 35.15065188248547


def fetch_emps(
    *, data_home: str | os.PathLike[str] | None = None, sha256: str | None = None, url: str = ""
) -> Bunch:
    """Download the EMPS benchmark: one prismatic axis with a ball screw, 25 s at 1 kHz.

    The recording is that of [1]_ as kept in the repository forgi86/sysid-neural-continuous, whose
    licence is Apache-2.0. Nothing of it comes with skidyn.

    Parameters
    ----------
    data_home : path, optional
        Folder to keep the file in; that of scikit-learn's data sets if None.
    sha256 : str, optional
        Checksum that the file must have. If None, that of the first download is kept beside the
        file and must hold ever after.
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
        The checksum is another one.
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
    return Bunch(frame=frame, licence="Apache-2.0", path=str(path))


def fetch_panda_exciting(
    *, data_home: str | os.PathLike[str] | None = None, sha256: str | None = None, url: str = ""
) -> Bunch:
    """Download an excitation of a Franka Emika Panda: 7 joints, 24 s at 30 Hz.

    The recording is a ROS 2 bag of the repository unisa-acg/inverse-dynamics-solver, whose licence
    is BSD-3-Clause. Nothing of it comes with skidyn. It is too slow for accelerations above a few
    hertz.

    Parameters
    ----------
    data_home : path, optional
        Folder to keep the file in; that of scikit-learn's data sets if None.
    sha256 : str, optional
        Checksum that the file must have. If None, that of the first download is kept beside the
        file and must hold ever after.
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
        The checksum is another one.
    ImportError
        pooch is not installed (``pip install skidyn[fetch]``).

    Examples
    --------
    >>> from skidyn.datasets import fetch_panda_exciting
    >>> panda = fetch_panda_exciting()  # doctest: +SKIP
    """
    path = _retrieve(url or PANDA_URL, "panda_exciting.db3", data_home, sha256)
    return Bunch(frame=read_log(path, check=False), licence="BSD-3-Clause", path=str(path))


def _retrieve(
    url: str, name: str, data_home: str | os.PathLike[str] | None, sha256: str | None
) -> Path:
    """Download once, and hold the file to its checksum ever after."""
    pooch = import_optional("pooch", extra="fetch")
    home = None if data_home is None else str(data_home)
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
    note.write_text(found, encoding="ascii")
    return file
