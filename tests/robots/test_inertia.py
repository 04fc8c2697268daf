"""Inertia tensors about the wrong point are found and explained, and those of the real robots pass."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nlp_gait.errors import RobotDataError
from nlp_gait.robots import Link, list_robots, load_robot
from nlp_gait.robots.tree import check_inertias, compute_joint_ratio, shift_to_com
from tests.robots.crooked import TORSO_KG, crooked, crooked_urdf
from tests.robots.custom import about_joints, humanoid, nao, six, written

# Sums of products of numbers with six digits.
TOLERANCE = 1e-15
BASE = TORSO_KG * 0.25**2 / 6.0  # moment of inertia of the torso
ROD = Link(name="rod", mass_kg=3.0, com_m=(0.0, 0.0, -0.5), inertia_com_kgm2=(0.25, 0.25, 0.0, 0.0, 0.0, 0.0))
BALL = Link(name="ball", mass_kg=1.0, com_m=(0.1, 0.0, 0.0), inertia_com_kgm2=(0.02, 0.02, 0.02, 0.0, 0.0, 0.0))


def test_ratios_by_hand() -> None:
    """A rod of 1 m and 3 kg held at its end: 0.25 m^2 against m L^2 / 12 / m = 1/12 m^2; a ball: 0.01 against 0.01."""
    assert compute_joint_ratio(ROD) == pytest.approx(3.0)
    assert compute_joint_ratio(BALL) == pytest.approx(1.0)


def test_the_wrong_tensor_of_a_rod_has_three_quarters_and_is_shifted_back() -> None:
    wrong = Link(name="rod", mass_kg=3.0, com_m=ROD.com_m, inertia_com_kgm2=(1.0, 1.0, 0.0, 0.0, 0.0, 0.0))
    assert compute_joint_ratio(wrong) == pytest.approx(0.75)
    assert shift_to_com(wrong).inertia_com_kgm2 == pytest.approx(ROD.inertia_com_kgm2)


@pytest.mark.parametrize("name", list_robots())
def test_the_real_robots_pass_by_a_wide_margin(name: str) -> None:
    links = load_robot(name).links.values()
    assert sum(compute_joint_ratio(link) > 1.0 for link in links) > len(links) / 2


@pytest.mark.parametrize("make", [nao, humanoid])
def test_tensors_about_the_joints_are_found_and_shifted_on_request(tmp_path: Path, make: Any) -> None:
    wrong = about_joints(make())
    with pytest.raises(
        RobotDataError, match=r"look as if taken about the joints.*none of its 25 links.*\"joint\""
    ) as error:
        load_robot(written(tmp_path, wrong))
    assert "l_ankle 0.93" in str(error.value)
    shifted = load_robot(written(tmp_path, wrong | {"inertia_about": "joint"}))
    right = load_robot(written(tmp_path, make()))
    for name, link in right.links.items():
        np.testing.assert_allclose(
            shifted.links[name].inertia_matrix, link.inertia_matrix, rtol=0, atol=TOLERANCE, err_msg=name
        )


def test_a_statement_that_they_are_right_is_accepted_for_the_links_of_its_own_file(tmp_path: Path) -> None:
    wrong = about_joints(nao())
    robot = load_robot(written(tmp_path, wrong | {"inertia_about": "com"}))
    assert six(robot.links["LThigh"].inertia_matrix) == wrong["links"]["LThigh"]["inertia_com_kgm2"]
    links = {"LThigh": wrong["links"]["LThigh"]}
    raw = {"schema": 1, "name": "mixed", "extends": "nao-v5", "inertia_about": "joint", "links": links}
    mixed, plain = load_robot(written(tmp_path, raw)), load_robot("nao-v5")
    for name, link in plain.links.items():
        np.testing.assert_allclose(mixed.links[name].inertia_matrix, link.inertia_matrix, rtol=0, atol=TOLERANCE)
    with pytest.raises(RobotDataError, match="inertia_about must be 'com' or 'joint', got 'origin'"):
        load_robot(written(tmp_path, nao() | {"inertia_about": "origin"}))


def test_tensors_that_no_body_has_are_balanced_as_by_mujoco(tmp_path: Path) -> None:
    """One of a shank in its own axes; the file says nothing of it, and MuJoCo's model of the file does."""
    mujoco = pytest.importorskip("mujoco")
    shank = (
        '<link name="A_knee_link"><inertial><origin xyz="0 0 -0.08" rpy="0.3 -0.2 0.1"/><mass value="0.8"/><inertia '
    )
    moments = 'ixx="0.001" iyy="0.002" izz="0.006" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    text = re.sub(r'<link name="A_knee_link">.*?</link>', shank + moments, crooked_urdf())
    robot = load_robot(crooked(tmp_path, text))
    assert any("A_knee_link (0.001, 0.002, 0.006 kg m^2)" in note for note in robot.notes)
    compiler = '<mujoco><compiler balanceinertia="true" boundmass="1e-6" boundinertia="1e-9"/></mujoco>'
    file = text.replace('"-1e-3"', '"1e-3"').replace('name="crooked">', f'name="crooked">{compiler}')
    model = mujoco.MjModel.from_xml_string(file)
    np.testing.assert_allclose(np.diag(model.body("A_knee_link").inertia), robot.links["A_knee_link"].inertia_matrix)
    with pytest.raises(ValueError, match="balanceinertia"):
        mujoco.MjModel.from_xml_string(file.replace('balanceinertia="true" ', ""))


def test_slightly_negative_moments_are_zero(tmp_path: Path) -> None:
    text = crooked_urdf().replace(
        '<inertia ixx="-1e-3" iyy="1e-3" izz="1e-3"', '<inertia ixx="-5e-8" iyy="1e-3" izz="1e-3"'
    )
    hand = load_robot(crooked(tmp_path, text)).links["A_hand"]
    assert six(hand.inertia_matrix) == pytest.approx([0.0, 1e-3, 1e-3, 0.0, 0.0, 0.0])


def test_few_links_or_links_near_their_joints_prove_nothing() -> None:
    far = Link(name="far", mass_kg=1.0, com_m=(0.09, 0.0, 0.0), inertia_com_kgm2=BALL.inertia_com_kgm2)  # ratio 0.81
    near = Link(name="near", mass_kg=1.0, com_m=(0.05, 0.0, 0.0), inertia_com_kgm2=BALL.inertia_com_kgm2)  # 0.25

    def named(*links: Link) -> list[Link]:
        return [
            Link(name=f"{k}", mass_kg=v.mass_kg, com_m=v.com_m, inertia_com_kgm2=v.inertia_com_kgm2)
            for k, v in enumerate(links)
        ]

    check_inertias("few", named(*[far] * 4))
    check_inertias("near", named(far, far, near, near, near))
    check_inertias("one that is right", named(far, far, far, far, ROD))
    for links in ([far] * 5, [far, far, far, near, near, near]):
        with pytest.raises(RobotDataError, match=rf"robot 'wrong'.*none of its {len(links)} links"):
            check_inertias("wrong", named(*links))


def test_a_link_denser_than_osmium_is_noted(tmp_path: Path) -> None:
    """Half the tensor of a ball of osmium of 9 kg, 0.4 m r^2 with 22.59 g/cm^3, is noted; that of a ball of iron is not."""
    notes = []
    for density, factor in ((7874.0, 1.0), (22590.0, 0.5)):
        radius = (TORSO_KG / (4 / 3 * math.pi * density)) ** (1 / 3)
        moment = factor * 0.4 * TORSO_KG * radius**2
        text = crooked_urdf().replace(
            f'ixx="{BASE}" iyy="{BASE}" izz="{BASE}"', f'ixx="{moment}" iyy="{moment}" izz="{moment}"'
        )
        assert text != crooked_urdf()
        notes.append([note for note in load_robot(crooked(tmp_path, text)).notes if "osmium" in note])
    assert notes[0] == [] and len(notes[1]) == 1 and "of base are" in notes[1][0]
