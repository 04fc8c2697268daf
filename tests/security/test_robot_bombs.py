"""Small robot files that ask for endless time or memory are rejected in one sentence, within the limits."""

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from nlp_gait.errors import RobotDataError
from nlp_gait.robots import load_robot, mjcf
from nlp_gait.robots.meshes import read_mesh_points
from nlp_gait.robots.mjcf import read_mjcf

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of memory exist on Linux")

TIME_S, MEMORY_BYTES = 0.3, 300 * 2**20
SLACK_S = 5.0  # of a busy machine
TIME, MEMORY = "was not read within 0.3 s; simplify the file", "memory"


def _write_model(head: str = "", body: str = "") -> str:
    shape = '<geom size="0.1"/>'
    return f'<mujoco>{head}<worldbody><body name="a"><freejoint/>{shape}{body}</body></worldbody></mujoco>'


def _repeat(*counts: int) -> str:
    text = '<geom size="0.1"/>'
    for count in counts:
        text = f'<replicate count="{count}" offset="0 0 1">{text}</replicate>'
    return text


BOMBS = (
    *(_write_model(body=_repeat(*counts)) for counts in ((2_000_000_000,), (7, 300, 5000))),
    _write_model('<size nkey="2000000000"/>'),
    _write_model('<size nuser_geom="200000000"/>'),
    _write_model('<asset><hfield name="h" nrow="40000" ncol="40000" size="1 1 1 1"/></asset>'),
    _write_model('<include file="pipe"/>'),
    _write_model(
        '<compiler meshdir="."/><asset><mesh name="m" file="pipe.obj"/></asset>', '<geom type="mesh" mesh="m"/>'
    ),
    _write_model('<include file="more.xml"/>'),
)


@pytest.mark.parametrize("text", BOMBS)
def test_a_model_that_takes_too_much_is_rejected(tmp_path: Path, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mjcf, "TIME_LIMIT_S", TIME_S)
    monkeypatch.setattr(mjcf, "MEMORY_LIMIT_BYTES", MEMORY_BYTES)
    for name in ("pipe", "pipe.obj"):
        os.mkfifo(tmp_path / name)
    (tmp_path / "more.xml").write_text('<mujocoinclude><size nkey="2000000000"/></mujocoinclude>')
    file = tmp_path / "bomb.xml"
    file.write_text(text)
    began = time.monotonic()
    with pytest.raises(RobotDataError, match=f"{MEMORY}|{TIME}") as raised:
        read_mjcf(str(file))
    assert str(file) in str(raised.value) and "\n" not in str(raised.value)
    assert time.monotonic() - began < TIME_S + SLACK_S  # far less than the limit of 60 s


COLLADA = (
    '<COLLADA><library_geometries><geometry id="g"><mesh><source id="s"><float_array>'
    + "0 1 2 " * 1000
    + "</float_array>"
    '</source><vertices><input semantic="POSITION" source="#s"/></vertices></mesh></geometry></library_geometries>'
    "<library_visual_scenes><visual_scene><node>" + '<instance_geometry url="#g"/>' * 20_000 + "</node></visual_scene>"
    "</library_visual_scenes></COLLADA>"
)
CHAIN = "".join(f'<link name="a{k}"/><joint name="j{k}" type="fixed"/>' for k in range(20_000))
JOINTS = '<body><joint/><geom size="1"/></body>'


@pytest.mark.parametrize(
    ("read", "name", "text", "message"),
    [
        (read_mesh_points, "bomb.dae", COLLADA, "more than 4000000 points; simplify it"),
        (
            load_robot,
            "chain.urdf",
            f'<robot name="r">{CHAIN}</robot>',
            "has 40000 links and joints, more than 2000; simplify",
        ),
        (load_robot, "joints.xml", _write_model(body=JOINTS * 401), "has 401 turning joints, more than 400; remove"),
    ],
    ids=["instances of a shape", "links", "401 joints"],
)
def test_what_is_too_long_is_rejected(
    tmp_path: Path, read: Callable[[Any], object], name: str, text: str, message: str
) -> None:
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(RobotDataError, match=message):
        read(file if read is read_mesh_points else str(file))
