# SPDX-License-Identifier: BSD-3-Clause
"""Settings and fixtures of the whole test suite."""

import hashlib
import importlib
import os
import pickle
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace

# One thread and one process per worker: pytest-xdist already uses the cores, and results must not
# depend on how many there are. The last is what joblib, and with it skidyn, takes for all cores;
# tests of several processes ask for their number. Set before NumPy and torch read them.
_ONE = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "LOKY_MAX_CPU_COUNT")
for _variable in _ONE:
    os.environ.setdefault(_variable, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

import pytest  # noqa: E402

REPOSITORY = Path(__file__).resolve().parents[1]


def find_data_dir() -> Path | None:
    """Folder of the real recordings: ``$SKIDYN_DATA``, else ``../shared/data``, else None."""
    named = os.environ.get("SKIDYN_DATA")
    folder = Path(named) if named else REPOSITORY.parent / "shared" / "data"
    return folder if folder.is_dir() else None


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of the real recordings; the test is skipped where there is none."""
    folder = find_data_dir()
    if folder is None:
        pytest.skip("real recordings not found; set SKIDYN_DATA to their folder")
    return folder


@pytest.fixture(scope="session")
def c_compiler() -> str:
    """Command of a C compiler; the test is skipped where there is none."""
    names = (os.environ.get("CC", "cc"), "gcc", "clang")
    found = [command for name in names if (command := shutil.which(name))]
    return found[0] if found else pytest.skip("no C compiler")


@pytest.fixture(scope="session")
def fresh_processes():
    """No processes of joblib are left from other tests, and two new ones have loaded torch.

    One that loads torch after its first task is taken for one that leaks memory, and is replaced.
    """
    from joblib import Parallel, delayed
    from joblib.externals.loky import get_reusable_executor

    get_reusable_executor().shutdown(wait=True)
    Parallel(n_jobs=2)(delayed(importlib.import_module)("skorch") for _ in range(2))


@pytest.fixture
def saved(tmp_path):
    """Writes a table as CSV and returns its path."""

    def save(frame, name="log.csv"):
        frame.to_csv(tmp_path / name, index=False)
        return tmp_path / name

    return save


@pytest.fixture(scope="session")
def signals_of():
    """Makes signals of the columns of a log; accelerations that it lacks are zero."""
    import numpy as np

    from skidyn.effects import Signals

    def make(frame, robot):
        numbers = range(1, robot.n_joints + 1)
        q, dq = (frame[[f"{name}{k}" for k in numbers]].to_numpy() for name in ("q", "dq"))
        ddq = frame.reindex(columns=[f"ddq{k}" for k in numbers], fill_value=0.0).to_numpy()
        time = frame["time"].to_numpy()
        slides = np.array([kind == "prismatic" for kind in robot.joint_types])
        trajectory = frame["trajectory"].to_numpy()
        return Signals(q, dq, ddq, trajectory, time=time, prismatic=slides, robot=robot)

    return make


@pytest.fixture(scope="module")
def diagnosed_once():
    """EffectSearchCV diagnoses each log once, since what follows a diagnosis is tested."""
    import numpy as np

    from skidyn.diagnosis import diagnose

    made = {}

    def once(model, X, y, **options):
        key = (repr(model), np.asarray(X).tobytes(), y.tobytes(), repr(options))
        if key not in made:
            made[key] = diagnose(model, X, y, **options)
        return made[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("skidyn.diagnosis._effect_search.diagnose", once)
        yield


@pytest.fixture(scope="session")
def servo_log(tmp_path_factory):
    """Makes the log of a planar arm behind servos, by the coefficients of what it hides."""
    folder, made = tmp_path_factory.getbasetemp(), {}
    if "PYTEST_XDIST_WORKER" in os.environ:  # what one worker has made is read by the others
        folder = folder.parent

    def make(terms, **untold):
        key = repr((list(terms.items()), untold))  # a simulation takes seconds
        if key not in made:
            file = folder / f"servo_log_{hashlib.sha256(key.encode()).hexdigest()}.pickle"
            if not file.exists():
                new = tmp_path_factory.mktemp("servo_log") / file.name
                new.write_bytes(pickle.dumps(_servo_log(terms, **untold)))
                os.replace(new, file)  # no worker reads half of it
            made[key] = pickle.loads(file.read_bytes())
        servo = made[key]
        return SimpleNamespace(**vars(servo) | {"log": servo.log.copy()})

    return make


@pytest.fixture(scope="session")
def sticky_servo(servo_log):
    """An arm behind servos whose second joint sticks: robot, log, controller."""
    from skidyn.effects import Term

    return servo_log({Term("stribeck", (2,), {"vs": 0.1, "delta": 2.0}): 0.15})


def _servo_log(terms, **untold):
    """A planar arm behind servos, with rounded positions, no torque, and what nobody was told."""
    from dataclasses import replace

    import numpy as np

    from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    from skidyn.identification import RBDRegressor
    from skidyn.simulation import Controller, simulate

    servo = Controller((200.0, 12.0), (12.0, 0.6), follows_velocity=False)
    friction = {"viscous": (0.4, 0.03), "coulomb": (0.8, 0.06)}
    encoder = 2 * np.pi / 2**14
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4, duration=2.0)
    truth = RBDRegressor(log.robot, [*friction, *terms], "nominal").fit(log.X, log.y)
    for term in truth.effect_terms_:
        size = terms[term] if term in terms else friction[term.kind][term.places[0]]
        truth.effect_coefficients_[term] = np.array([size])
    wanted = log.X.assign(q_ref1=log.X["q1"], q_ref2=log.X["q2"])
    moved = simulate(truth, wanted, controller=replace(servo, **untold), step=2.5e-3)
    for j in (1, 2):
        moved[f"q{j}"] = np.round(moved[f"q{j}"] / encoder) * encoder
        for _, run in moved.groupby("trajectory"):
            moved.loc[run.index, f"dq{j}"] = np.gradient(run[f"q{j}"], run["time"])
    columns = ["time", "trajectory", "q1", "q2", "dq1", "dq2", "q_ref1", "q_ref2"]
    return SimpleNamespace(robot=log.robot, log=moved[columns], controller=servo)


@pytest.fixture(scope="session")
def chain():
    """Writes the URDF of links one after the other, which turn about y, from names of joints."""
    body = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    link = f'<link name="l{{}}"><inertial><mass value="1"/>{body}</inertial></link>'
    joint = (
        '<joint name="{}" type="continuous"><parent link="l{}"/><child link="l{}"/>'
        '<axis xyz="0 1 0"/></joint>'
    )

    def write(names):
        parts = [link.format(k) for k in range(len(names) + 1)]
        parts += [joint.format(name, k, k + 1) for k, name in enumerate(names)]
        return f"<robot name='r'>{''.join(parts)}</robot>"

    return write


@pytest.fixture
def secret(tmp_path, monkeypatch):
    """A file beside the working folder, and the names by which an attacker may call it."""
    (tmp_path / "secret").mkdir()
    file = tmp_path / "secret" / "secret.stl"
    file.write_text("the secret")
    (tmp_path / "work" / "x").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "work")
    names = [str(file), "../secret/secret.stl", file.as_uri(), "x/../../secret/secret.stl"]
    return file, [*names, "package://../../secret/secret.stl"]


_OPENED: list[str] | None = None


def _audit(event, arguments):
    if event == "open" and _OPENED is not None and isinstance(arguments[0], (str, bytes)):
        _OPENED.append(os.path.realpath(os.fsdecode(arguments[0])))


@pytest.fixture(scope="session")
def opened():
    """Gives the real paths of all files that a call opens, whatever library opens them."""
    sys.addaudithook(_audit)  # cannot be removed, so it does nothing outside of a call

    def watch(call):
        global _OPENED
        _OPENED = seen = []
        try:
            call()
        finally:
            _OPENED = None
        return set(seen)

    return watch
