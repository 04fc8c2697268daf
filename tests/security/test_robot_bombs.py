"""Small robot files that ask for endless time or memory are rejected in one sentence, within the limits."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from nlp_gait.errors import RobotDataError
from nlp_gait.robots import limits
from nlp_gait.robots.meshes import mesh_points
from nlp_gait.robots.mjcf import mjcf_record

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


def _make_bombs() -> Iterator[tuple[str, str]]:
    yield _write_model(body=_repeat(2_000_000_000)), TIME
    yield _write_model(body=_repeat(1000, 1000, 1000)), TIME
    yield _write_model('<size nkey="2000000000"/>'), TIME
    yield _write_model('<include file="pipe"/>'), TIME
    for side in (20_000, 40_000):
        yield _write_model(f'<asset><hfield name="h" nrow="{side}" ncol="{side}" size="1 1 1 1"/></asset>'), MEMORY
    yield _write_model('<size nuser_geom="200000000"/>'), MEMORY


@pytest.fixture(autouse=True)
def small_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "TIME_LIMIT_S", TIME_S)
    monkeypatch.setattr(limits, "MEMORY_LIMIT_BYTES", MEMORY_BYTES)


@pytest.mark.parametrize(("text", "reason"), [*_make_bombs()])
def test_a_model_that_takes_too_much_is_rejected(tmp_path: Path, text: str, reason: str) -> None:
    pytest.importorskip("mujoco")
    os.mkfifo(tmp_path / "pipe")
    file = tmp_path / "bomb.xml"
    file.write_text(text)
    began = time.monotonic()
    with pytest.raises(RobotDataError, match=f"{reason}|{TIME}") as raised:
        mjcf_record(str(file))
    assert str(file) in str(raised.value) and "\n" not in str(raised.value)
    assert time.monotonic() - began < TIME_S + SLACK_S


def test_a_collada_file_with_many_instances_is_rejected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("lxml")
    monkeypatch.setattr(limits, "TIME_LIMIT_S", 60.0)
    file = tmp_path / "bomb.dae"
    file.write_text(
        '<COLLADA><library_geometries><geometry id="g"><mesh><source id="s"><float_array>'
        + "0 1 2 " * 1000
        + '</float_array></source><vertices><input semantic="POSITION" source="#s"/></vertices></mesh></geometry>'
        "</library_geometries><library_visual_scenes><visual_scene><node>"
        + '<instance_geometry url="#g"/>' * 20_000
        + "</node></visual_scene></library_visual_scenes></COLLADA>"
    )
    with pytest.raises(RobotDataError, match="more than 4000000 points; simplify it"):
        mesh_points(file)
