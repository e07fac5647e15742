# SPDX-License-Identifier: BSD-3-Clause
"""A file of the user changes in its bodies and in the friction of its joints alone."""

import re
from importlib.resources import files

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.export import merge_urdf
from skidyn.identification import RBDRegressor

TEXT = (files("skidyn.datasets") / "robots" / "planar_arm.urdf").read_text("utf-8")


@pytest.fixture(scope="module")
def model():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=4.0)
    return RBDRegressor(log.robot, consistent=True).fit(log.X, log.y)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_all_else_stays_to_the_byte(model, tmp_path, end, encoding):
    odd = TEXT.replace('<link name="base"/>', "<link   name='base' ></link><!-- Gelenk: ä -->")
    own = odd.replace("\n", end).encode(encoding)
    (tmp_path / "own.urdf").write_bytes(own)
    merge_urdf(model, tmp_path / "own.urdf", tmp_path / "new.urdf")
    new = (tmp_path / "new.urdf").read_bytes()
    assert new != own
    # the bodies are written anew, on one line, and of the joints the friction alone
    bodies = re.compile(rb"<inertial>.*?</inertial>", re.DOTALL)
    number = re.compile(rb'(damping|friction)="[^"]*"')
    stays = [number.sub(b"", bodies.sub(b"", text)) for text in (own, new)]
    assert stays[0] == stays[1]
    assert len(bodies.findall(new)) == len(bodies.findall(own)) == 2


def test_a_file_that_is_no_xml_is_refused_and_nothing_is_written(model, tmp_path):
    (tmp_path / "own.urdf").write_text("<robot name='arm'><link")
    with pytest.raises(SkidynError, match=r"own\.urdf"):
        merge_urdf(model, tmp_path / "own.urdf", tmp_path / "new.urdf")
    assert not (tmp_path / "new.urdf").exists()
