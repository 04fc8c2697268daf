"""A robot of our own as a URDF: an offset in every joint of its legs, an arm, and the oddities that real files have."""

from pathlib import Path

# Origins [m] and axes of the left leg; the right one is its mirror image. No two axes of hip or ankle cross.
LEG = {
    "hip_yaw": ((0.010, 0.080, -0.050), (0.0, 0.0, 1.0), (-0.6, 0.6)),
    "hip_roll": ((0.008, 0.005, -0.020), (1.0, 0.0, 0.0), (-0.5, 0.5)),
    "hip_pitch": ((0.005, 0.010, -0.015), (0.0, 1.0, 0.0), (-1.6, 0.8)),
    "knee": ((0.010, 0.003, -0.200), (0.0, 1.0, 0.0), (-0.1, 2.3)),
    "ankle_pitch": ((-0.005, 0.002, -0.190), (0.0, 1.0, 0.0), (-1.2, 0.9)),
    "ankle_roll": ((0.004, -0.002, -0.012), (1.0, 0.0, 0.0), (-0.6, 0.6)),
}
MASSES = (0.6, 0.5, 1.4, 1.1, 0.3, 0.6)
TORSO_KG, ARM_KG = 9.0, 1.0
SOLE_M = (0.17, 0.09, 0.02)  # a box below the ankle, a centimetre ahead of it
SOLE_AHEAD_M, ANKLE_M = 0.02, 0.045


def link(name: str, mass: float, com: tuple[float, float, float], size: float, more: str = "") -> str:
    moment = mass * size**2 / 6.0
    return (
        f'<link name="{name}"><inertial><origin xyz="{com[0]} {com[1]} {com[2]}"/><mass value="{mass}"/>'
        f'<inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial>{more}</link>'
    )


def joint(
    name: str,
    parent: str,
    child: str,
    origin: tuple[float, float, float],
    axis: tuple[float, float, float],
    limits: tuple[float, float],
    effort: float = 60.0,
    velocity: float = 6.0,
) -> str:
    return (
        f'<joint name="{name}" type="revolute"><origin xyz="{origin[0]} {origin[1]} {origin[2]}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis[0]} {axis[1]} {axis[2]}"/>'
        f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="{effort}" velocity="{velocity}"/></joint>'
    )


def crooked_urdf(*, sole: bool = True) -> str:
    """Text of the file; names of left and right are of no use to a program."""
    parts = [link("base", TORSO_KG, (0.0, 0.0, 0.15), 0.25)]
    for prefix, sign in (("A", 1.0), ("B", -1.0)):
        parent = "base"
        for (name, ((x, y, z), axis, limits)), mass in zip(LEG.items(), MASSES, strict=True):
            child = f"{prefix}_{name}_link"
            shape = ""
            if name == "ankle_roll" and sole:
                size = " ".join(map(str, SOLE_M))
                centre = f"{SOLE_AHEAD_M} {sign * 0.003} {SOLE_M[2] / 2 - ANKLE_M}"
                shape = f'<collision><origin xyz="{centre}"/><geometry><box size="{size}"/></geometry></collision>'
            com = (0.002, sign * 0.004, {"hip_pitch": -0.09, "knee": -0.08}.get(name, -0.005))
            parts.append(link(child, mass, com, 0.1, shape))
            # A reflection turns an axis along x or z round.
            mirrored = limits if sign > 0 or axis[1] else (-limits[1], -limits[0])
            parts.append(joint(f"{prefix}_{name}", parent, child, (x, sign * y, z), axis, mirrored))
            parent = child
        arm = f"{prefix}_arm"
        parts.append(link(arm, ARM_KG, (0.0, 0.0, -0.15), 0.15))
        parts.append(joint(f"{prefix}_shoulder", "base", arm, (0.0, sign * 0.2, 0.3), (0.0, 1.0, 0.0), (0.2, 2.0)))
        # What real files have: a finger without mass, and a hand with a negative moment.
        parts.append(f'<link name="{prefix}_finger"/>')
        parts.append(joint(f"{prefix}_grip", arm, f"{prefix}_finger", (0.0, 0.0, -0.3), (0.0, 1.0, 0.0), (-1.0, 1.0)))
        parts.append(
            f'<link name="{prefix}_hand"><inertial><mass value="0.1"/>'
            '<inertia ixx="-1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
        parts.append(joint(f"{prefix}_wrist", arm, f"{prefix}_hand", (0.0, 0.0, -0.3), (0.0, 1.0, 0.0), (-1.0, 1.0)))
    return f'<?xml version="1.0"?>\n<robot name="crooked">{"".join(parts)}</robot>\n'


def crooked(folder: Path, text: str | None = None) -> str:
    """Path of the file in a folder."""
    path = folder / "crooked.urdf"
    path.write_text(crooked_urdf() if text is None else text, encoding="utf-8")
    return str(path)
