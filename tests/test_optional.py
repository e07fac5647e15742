# SPDX-License-Identifier: BSD-3-Clause
"""A package that only some users need."""

import sys

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.export import write_onnx
from skidyn.identification import RBDRegressor


@pytest.fixture
def model():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=1.0)
    return RBDRegressor(log.robot, smooth=False).fit(log.X, log.y)


def test_missing_optional_package_names_the_extra(model, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(ImportError, match=r"pip install 'skidyn\[export\]'"):
        write_onnx(model, tmp_path / "model.onnx")


def test_broken_optional_package_is_not_called_missing(model, tmp_path, monkeypatch):
    (tmp_path / "onnx.py").write_text("import no_such_dependency\n")
    for name in [n for n in sys.modules if n.partition(".")[0] == "onnx"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="no_such_dependency"):
        write_onnx(model, tmp_path / "model.onnx")
