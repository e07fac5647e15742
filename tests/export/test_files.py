# SPDX-License-Identifier: BSD-3-Clause
"""Beside every file stands what it does not hold."""

import json

import pytest

from skidyn.datasets import load_planar_arm
from skidyn.effects import Term
from skidyn.export import write_c, write_mjcf, write_onnx, write_python, write_urdf

MEMORY = [
    Term("dahl", (1,), {"presliding": 0.02}),
    Term("maxwell_slip", (2,), {"presliding": 0.02}),
    Term("offset", (1,), {"trajectory": 0}),
]


def test_what_no_function_holds_is_listed_and_complete_beside_every_file(fit, states, tmp_path):
    pytest.importorskip("onnx", reason="needs skidyn[export]")
    model = fit(load_planar_arm(), ["viscous", "offset", MEMORY[0]], consistent=True)
    names = {"c": (), "python": (), "onnx": (), "urdf": ("offset",) * 2, "mjcf": ("offset",) * 2}
    writers = {
        "c": write_c, "python": write_python, "onnx": write_onnx,
        "urdf": write_urdf, "mjcf": write_mjcf,
    }  # fmt: skip
    for form, write in writers.items():
        left = write(model, tmp_path / f"arm.{form}")
        assert [name.split()[0] for name in left] == [*names[form], "dahl"], form
        beside = json.loads((tmp_path / f"arm.{form}.skidyn.json").read_text())
        assert set(beside) == {"schema", "file", "joints", "not_held"}
        assert beside["joints"] == ["joint1", "joint2"]
        (dahl,) = (e for e in beside["not_held"] if e["kind"] == "dahl")
        assert dahl["joints"] == ["joint1"] and dahl["units"] == {"F": "N m"}
        assert dahl["coefficients"]["F"] == model.effect_coefficients_[MEMORY[0]][0]
        assert dahl["shape"] == {"presliding": 0.02}
    write_c(load_planar_arm(), tmp_path / "arm.c")
    assert not (tmp_path / "arm.c.skidyn.json").exists()  # it would lie about the new file
