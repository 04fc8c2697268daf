"""A hundred hostile robot files: URDF and MJCF, with meshes in STL, OBJ and Collada."""

from __future__ import annotations

import os
import random
from collections.abc import Iterator
from pathlib import Path

TRIANGLE = "facet normal 0 0 1 outer loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop endfacet\n"
MILLION = 10**6


def write_hostile_robots(folder: Path, seed: int) -> Iterator[Path]:
    """Write each file with those that it names to a folder of its own; yield the robots' files."""
    draw = random.Random(seed)
    kinds = [("mjcf", text) for text in _write_mjcf(draw)] + [("urdf", text) for text in _write_urdf(draw)]
    for number, (kind, text) in enumerate(kinds):
        place = folder / str(number)
        place.mkdir(parents=True)
        _write_companions(place, draw)
        file = place / ("robot.xml" if kind == "mjcf" else "robot.urdf")
        file.write_text(text, encoding="utf-8")
        yield file


def _write_companions(place: Path, draw: random.Random) -> None:
    """Write what the files name: small files that say more than they hold, and what is not a file."""
    os.mkfifo(place / "pipe.stl")
    (place / "zero.obj").symlink_to("/dev/zero")
    (place / "endless.xml").symlink_to("/dev/zero")
    (place / "self.xml").write_text('<mujocoinclude><include file="self.xml"/></mujocoinclude>')
    (place / "bomb.xml").write_text(f'<mujocoinclude><size nkey="{draw.randrange(10**8, 10**10)}"/></mujocoinclude>')
    (place / "claims.stl").write_bytes(bytes(80) + (2**32 - 1).to_bytes(4, "little") + bytes(50))
    (place / "nan.stl").write_text("solid\n" + TRIANGLE.replace("1 0 0", "nan inf 1e999"))
    (place / "words.obj").write_text("v 1 2\nv x y z\nv\n" * 1000)
    (place / "long.obj").write_text("v " + "9" * MILLION + " 0 0\n")
    (place / "claims.bin").write_bytes((2**31 - 1).to_bytes(4, "little") * 2 + bytes(16))
    with open(place / "huge.obj", "wb") as file:
        file.truncate(2**34)
    nodes = "<node><scale>9 9 9</scale>" * 500 + "</node>" * 500
    points = '<source id="s"><float_array>' + "0 1 2 " * 4000 + "</float_array></source>"
    for name, scene in (
        ("deep.dae", nodes),
        ("many.dae", "<node>" + '<instance_geometry url="#g"/>' * draw.randrange(2000, 30_000) + "</node>"),
        ("entities.dae", "<node>&a9;</node>"),
    ):
        doctype = "".join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10 if k else "lol"}">' for k in range(10))
        (place / name).write_text(
            (f"<!DOCTYPE COLLADA [{doctype}]>" if "entities" in name else "")
            + f'<COLLADA><library_geometries><geometry id="g"><mesh>{points}<vertices><input semantic="POSITION" '
            f'source="#s"/></vertices></mesh></geometry></library_geometries><library_visual_scenes><visual_scene>{scene}'
            "</visual_scene></library_visual_scenes></COLLADA>"
        )


def _write_mjcf(draw: random.Random) -> Iterator[str]:
    def model(head: str = "", body: str = "", after: str = "") -> str:
        shape = '<geom size="0.1"/>'
        return f'<mujoco>{head}<worldbody><body name="a"><freejoint/>{shape}{body}</body></worldbody>{after}</mujoco>'

    def huge() -> int:
        return draw.randrange(4 * 10**7, 2**31 - 1)

    for name in ("nkey", "njmax", "nconmax", "nuser_geom", "nuser_body", "nuser_jnt", "nuser_sensor", "nuserdata"):
        yield model(f'<size {name}="{huge()}"/>')
        yield model(f'<size {name}="  {huge()} "/>', '<body><joint/><geom size="1"/></body>' * 20)
    for _ in range(6):
        text = '<geom size="0.1"/>'
        for _ in range(draw.randrange(1, 7)):
            text = f'<replicate count="{draw.randrange(300, 3 * 10**6)}" euler="0 0 1">{text}</replicate>'
        yield model(body=text)
        sides = " ".join(str(draw.randrange(60, 3000)) for _ in range(3))
        yield model(body=f'<flexcomp name="f" type="grid" spacing="1 1 1" count="{sides}"/>')
        rows, columns = draw.randrange(8000, 60_000), draw.randrange(8000, 60_000)
        yield model(f'<asset><hfield name="h" nrow="{rows}" ncol="{columns}" size="1 1 1 1"/></asset>')
        yield model(f'<asset><texture type="2d" builtin="flat" width="{rows}" height="{columns}"/></asset>')
    for name in ("bomb.xml", "self.xml", "endless.xml", "pipe.stl", ".", "absent.xml", "../../../../etc/passwd"):
        yield model(f'<include file="{name}"/>')
    for name in ("pipe.stl", "zero.obj", "claims.stl", "nan.stl", "words.obj", "long.obj", "huge.obj", "absent.obj"):
        mesh = f'<asset><mesh name="m" file="{name}"/></asset>'
        yield model(mesh, '<geom type="mesh" mesh="m"/>')
    yield model('<asset><hfield name="h" file="claims.bin" size="1 1 1 1"/></asset>')
    for depth in (500, 2000, 30_000):
        yield model(body="<body>" * depth + '<geom size="1"/>' + "</body>" * depth)
        yield model("<default>" * depth + "</default>" * depth)
    yield model(body='<body><joint/><geom size="1"/></body>' * 150_000)
    yield model(after="<tendon>" + '<spatial><site site="s"/></spatial>' * 150_000 + "</tendon>")
    yield model(f'<option timestep="{"9" * MILLION}"/>')
    yield model(body=f'<geom size="{"1 " * MILLION}"/>')
    yield model(body=f'<body name="{"n" * 10 * MILLION}"><geom size="1"/></body>')


def _write_urdf(draw: random.Random) -> Iterator[str]:
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'

    def link(name: str, more: str = "") -> str:
        return f'<link name="{name}">{inertial}{more}</link>'

    def joint(number: int, parent: str, child: str) -> str:
        limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
        ends = f'<parent link="{parent}"/><child link="{child}"/>'
        return f'<joint name="j{number}" type="revolute">{ends}<axis xyz="0 1 0"/>{limit}</joint>'

    def legs(mesh: str) -> str:
        """Return two legs, whose feet have a mesh."""
        parts = [link("body")]
        for side, sign in (("l", 1), ("r", -1)):
            for k in range(7):
                shape = f'<collision><geometry><mesh filename="{mesh}"/></geometry></collision>' if k == 6 else ""
                parts.append(link(f"{side}{k}", shape))
                axis = ("0 0 1", "1 0 0", "0 1 0", "0 1 0", "0 1 0", "1 0 0")[min(k, 5)]
                parent, kind = ("body" if k == 0 else f"{side}{k - 1}"), ("fixed" if k == 6 else "revolute")
                place = f"0 {0.1 * sign if k == 0 else 0} {-0.3 if k in (3, 4) else 0}"
                parts.append(
                    f'<joint name="{side}j{k}" type="{kind}"><origin xyz="{place}"/><parent link="{parent}"/>'
                    f'<child link="{side}{k}"/><axis xyz="{axis}"/><limit lower="-1" upper="1" effort="9" velocity="9"/></joint>'
                )
        return f'<robot name="r">{"".join(parts)}</robot>'

    meshes = ("pipe.stl", "zero.obj", "claims.stl", "nan.stl", "words.obj", "long.obj", "huge.obj")
    for name in (*meshes, "deep.dae", "many.dae", "entities.dae", "package://../../etc/passwd.obj", "x.obj"):
        yield legs(name)
    for length in (1000, 20_000):
        chain = "".join(link(f"a{k}") + joint(k, f"a{k}", f"a{k + 1}") for k in range(length))
        yield f'<robot name="r">{chain}{link(f"a{length}")}</robot>'
    yield f'<robot name="r">{link("a") + joint(0, "a", "a")}</robot>'
    yield f'<robot name="r">{link("a") + link("b") + joint(0, "a", "b") + joint(1, "b", "a")}</robot>'
    entities = "".join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10 if k else "lol"}">' for k in range(draw.randrange(9, 20)))
    yield f'<!DOCTYPE r [{entities}]><robot name="r">&a8;{link("a")}</robot>'
    for place in ("file:///etc/passwd", "http://localhost:1/x", "pipe.stl"):
        yield f'<!DOCTYPE r [<!ENTITY x SYSTEM "{place}">]><robot name="r">&x;{link("a")}</robot>'
    yield f'<!DOCTYPE r SYSTEM "pipe.stl"><robot name="r">{link("a")}</robot>'
    yield "<robot>" * 20_000 + "</robot>" * 20_000
    yield f'<robot name="{"r" * 20 * MILLION}">{link("a")}</robot>'
    yield f'<robot name="r">{link("a" * MILLION) * 2}</robot>'
    for value in ("9" * MILLION, "nan", "inf", "1e400", "-0", "1e-320", "0x10", "1_0"):
        yield f'<robot name="r">{link("a").replace("1", value, 1)}</robot>'
    yield f'<robot name="r" {" ".join(f"a{k}={chr(34)}{chr(34)}" for k in range(200_000))}>{link("a")}</robot>'
