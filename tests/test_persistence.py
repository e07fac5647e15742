# SPDX-License-Identifier: BSD-3-Clause
"""Models on disk: what is stored comes back, and files that could run code are refused."""

import os
import pickle
import zipfile

import numpy as np
import pytest
from sklearn.base import BaseEstimator

import skidyn
from skidyn._exceptions import SkidynError
from skidyn.committee import ELMCommittee
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.hybrid import HybridRegressor
from skidyn.neural_network import BLLRegressor, LSTMRegressor, NDLRegressor, SDLRegressor
from skidyn.rigid_body import RBDRegressor

pytest.importorskip("skops.io")


class Foreign(BaseEstimator):
    """A type from elsewhere."""


def test_a_fitted_model_comes_back(tmp_path):
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=4.0)
    model = RBDRegressor(log.robot).fit(log.X, log.y)
    again = skidyn.load_model(skidyn.save_model(tmp_path / "m.skops", model))
    np.testing.assert_array_equal(again.predict(log.X), model.predict(log.X))


def learners(robot):
    """One of each, small."""
    small = {"window": 4, "hidden_size": 4, "max_epochs": 1, "random_state": 0}
    lstm = LSTMRegressor(**small)
    physics = RBDRegressor(robot)
    return [
        NDLRegressor(**small),
        SDLRegressor(robot, **small),
        BLLRegressor(lstm, n_estimators=2, random_state=0),
        ELMCommittee(2, n_hidden=10, random_state=0),
        HybridRegressor(physics, lstm, cv=2, alpha=1.0),
        HybridRegressor(physics, cv=2, alpha=1.0),
    ]


@pytest.mark.parametrize("number", range(6))
def test_every_learner_comes_back(tmp_path, number):
    log = make_hidden_effect_log(
        load_planar_arm(), "spring", n_trajectories=4, duration=3.0, rate=25.0
    )
    model = learners(log.robot)[number].fit(log.X, log.y)
    again = skidyn.load_model(skidyn.save_model(tmp_path / "m.skops", model))
    np.testing.assert_array_equal(again.predict(log.X), model.predict(log.X))
    with zipfile.ZipFile(tmp_path / "m.skops") as archive:  # arrays and a description, no pickles
        kinds = {name.rpartition(".")[2] for name in archive.namelist()}
    assert kinds <= {"npy", "json"}


def test_pickles_are_refused_and_never_run(tmp_path):
    class Attack:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "harm"),)

    (tmp_path / "m.pkl").write_bytes(pickle.dumps(Attack()))
    with pytest.raises(SkidynError, match="Pickles and joblib files are refused"):
        skidyn.load_model(tmp_path / "m.pkl")
    assert not (tmp_path / "harm").exists()


def test_foreign_types_need_to_be_named(tmp_path):
    file = skidyn.save_model(tmp_path / "m.skops", Foreign())
    with pytest.raises(SkidynError, match=r"not trusted: .*Foreign"):
        skidyn.load_model(file)


def test_damaged_files_are_told(tmp_path):
    with zipfile.ZipFile(tmp_path / "m.skops", "w") as archive:
        archive.writestr("schema.json", "{}")
    with pytest.raises(SkidynError, match="cannot be loaded"):
        skidyn.load_model(tmp_path / "m.skops")


def test_a_bomb_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("skidyn._persistence.MAX_BYTES", 1_000_000)
    with zipfile.ZipFile(tmp_path / "m.skops", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("schema.json", b" " * 5_000_000)
    with pytest.raises(SkidynError, match="unpacks to"):
        skidyn.load_model(tmp_path / "m.skops")


def test_a_full_disk_leaves_the_old_file(tmp_path, monkeypatch):
    (tmp_path / "m.skops").write_text("old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space left"):
        skidyn.save_model(tmp_path / "m.skops", RBDRegressor("a"))
    assert [f.name for f in tmp_path.iterdir()] == ["m.skops"]
    assert (tmp_path / "m.skops").read_text() == "old"
