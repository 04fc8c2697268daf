"""Robot files: the three NAOs, and a message for everything that can be wrong."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from nlp_gait.errors import RobotDataError
from nlp_gait.robots import list_robots, load_robot
from tests.robots.custom import written


def link(mass: Any = 1.0, inertia: Any = (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)) -> dict[str, Any]:
    return {"mass_kg": mass, "com_m": [0.0, 0.0, 0.0], "inertia_com_kgm2": list(inertia)}


def joint(parent: str, child: str) -> dict[str, Any]:
    return {
        "parent": parent,
        "child": child,
        "origin_m": [0.0, 0.0, -0.1],
        "axis": [0.0, 1.0, 0.0],
        "limits_rad": [-1.0, 1.0],
        "velocity_limit_rad_s": 5.0,
        "torque_limit_Nm": 2.0,
    }


def foot(name: str) -> dict[str, Any]:
    return {"link": name, "ankle_height_m": 0.05, "front_m": 0.1, "back_m": 0.05, "left_m": 0.04, "right_m": 0.04}


def tiny() -> dict[str, Any]:
    """A torso with two legs of one link."""
    return {
        "schema": 1,
        "name": "tiny",
        "root": "torso",
        "links": {"torso": link(), "left": link(), "right": link()},
        "joints": {"LHip": joint("torso", "left"), "RHip": joint("torso", "right")},
        "feet": {"left": foot("left"), "right": foot("right")},
    }


def with_joint_ring(raw: dict[str, Any]) -> None:
    raw["links"] |= {"a": link(), "b": link()}
    raw["joints"] |= {"A": joint("a", "b"), "B": joint("b", "a")}


def set_in(*path: str, to: object) -> Callable[[dict[str, Any]], None]:
    def change(raw: dict[str, Any]) -> None:
        for key in path[:-1]:
            raw = raw[key]
        raw[path[-1]] = to

    return change


DAMAGES = [
    (set_in("links", "left", "mass_kg", to=-1.0), r"link 'left': mass_kg must be > 0, got -1\.0"),
    (
        set_in("links", "left", "inertia_com_kgm2", to=[3e-3, 1e-3, 1e-3, 0, 0, 0]),
        r"link 'left': .* principal moments 1\.000e-03, 1\.000e-03, 3\.000e-03 .* shifted to the centre of mass twice\?",
    ),
    (set_in("joints", "LHip", "limits_rad", to=[1.0, -1.0]), r"joint 'LHip': limits_rad must be ordered .* \[1\.0, -1"),
    (set_in("joints", "LHip", "axis", to=[0.0, 2.0, 0.0]), r"axis must be a unit vector, got \(0\.0, 2\.0, 0\.0\)"),
    (set_in("joints", "LHip", "parent", to="tail"), r"joint 'LHip': link 'tail' does not exist"),
    (set_in("links", "tail", to=link()), r"robot 'tiny': exactly one link must have no parent, got torso, tail"),
    (with_joint_ring, r"robot 'tiny': joint '.*' is part of a ring of joints"),
    (set_in("root", to="pelvis"), r"robot 'tiny': root 'pelvis' is not the link without a parent, 'torso'"),
    (set_in("name", to=None), r"robot\.json': 'name' is missing"),
    (set_in("feet", to={"left": foot("left")}), r"robot 'tiny': foot 'right' is missing or names no link"),
    (set_in("schema", to=2), r"schema must be 1, got 2"),
]


@pytest.mark.parametrize(("damage", "message"), DAMAGES, ids=[message[:40] for _, message in DAMAGES])
def test_what_is_wrong_with_a_robot_is_reported(
    tmp_path: Path, damage: Callable[[dict[str, Any]], None], message: str
) -> None:
    raw = tiny()
    load_robot(written(tmp_path, raw))  # unharmed it loads
    damage(raw)
    with pytest.raises(RobotDataError, match=message):
        load_robot(written(tmp_path, raw))


@pytest.mark.parametrize("ring", ["a", "ab"])
def test_robots_that_extend_each_other_by_roundabout_paths_are_refused(tmp_path: Path, ring: str) -> None:
    for name, other in zip(ring, ring[1:] + ring[0], strict=True):
        raw = {"schema": 1, "name": name, "extends": f"../{tmp_path.name}/{other}.json"}
        (tmp_path / f"{name}.json").write_text(json.dumps(raw), encoding="utf-8")
    with pytest.raises(RobotDataError, match="'extends' must name another robot"):
        load_robot(str(tmp_path / "a.json"))


@pytest.mark.parametrize(("name", "mass_kg"), [("nao-v4", 5.19535), ("nao-v5", 5.30535), ("nao-v6", 5.35975)])
def test_nao_weighs_what_its_maker_says(name: str, mass_kg: float) -> None:
    assert name in list_robots()
    assert load_robot(name).mass_kg == pytest.approx(mass_kg, abs=1e-9)  # a sum of five-digit numbers


def test_only_the_head_of_v6_differs_from_v5_and_gaits_are_planned_within_the_limits_of_the_paper() -> None:
    v5, v6 = load_robot("nao-v5"), load_robot("nao-v6")
    assert {name for name in v5.links if v5.links[name] != v6.links[name]} == {"Head"}
    assert (v5.joints, v5.feet) == (v6.joints, v6.feet)
    knee = v5.joint("LKneePitch")
    assert knee.planning_limits_rad == (-0.09, 2.11) != knee.limits_rad


def test_a_file_that_extends_a_robot_replaces_single_records(tmp_path: Path) -> None:
    base = load_robot("nao-v5")
    raw = {"schema": 1, "name": "heavy", "extends": "nao-v5", "links": {"LThigh": link(mass=9.0)}}
    with pytest.raises(RobotDataError, match=r"links must be an object, got \['LThigh'\]"):
        load_robot(written(tmp_path, raw | {"links": ["LThigh"]}))
    heavy = load_robot(written(tmp_path, raw))
    assert heavy.mass_kg == pytest.approx(base.mass_kg - base.links["LThigh"].mass_kg + 9.0)
    assert heavy.joints == base.joints
