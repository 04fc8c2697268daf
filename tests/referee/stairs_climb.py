"""The regular step of a climb for many x at once: quantised dynamics (44), (45), and the loads of every interval."""

from collections.abc import Sequence

import numpy as np

from tests.referee.series import Array
from tests.referee.stairs import EDGE, FOOT, FRICTION, MOVING, RODS, SETBACK, grip_rows, ground_rows, loads

INTERVALS, SOLE_OFF, TOE_OFF = 70, 10, 28  # t1 = 0.5 s and t2 = 1.4 s of 3.5 s (Table III)
STEP_S = 3.5 / INTERVALS
KINDS = (("angle", "rad"), ("rate", "rad_s"))
TORQUE_WEIGHT, ACCELERATION_WEIGHT = 0.01, 1e-3
RESERVE = 0.01  # by which edges are nearer to feet
SHANK, ROUNDING = 0.025, 0.005  # radius of a shank, and of the corner between what keeps it outside [m]


def regular_step(X: Array, names: Sequence[str], length: float = 0.508, ratio: float = 0.70) -> dict[str, Array]:
    """Effort and rows by name, each (P,), at X (P, n) whose columns have these names."""
    column = {name: k for k, name in enumerate(names)}
    run, rise = length / 2, ratio * length / 2

    def table(form: str, count: int, part: str = "next") -> Array:
        return np.stack([X[:, column[f"{part}_{form.format(k)}"]] for k in range(count)])

    n = INTERVALS
    angle, rate = ({link: table(f"{kind}_{link}_{unit}[{{}}]", n + 1) for link in MOVING} for kind, unit in KINDS)
    acceleration = {link: table(f"acceleration_{link}_rad_s2[{{}}]", n) for link in MOVING}
    toe, sole = (
        np.stack([table(f"{point}_force_{axis}_N[{{}}]", count) for axis in "xz"])
        for point, count in (("toe", TOE_OFF), ("sole", SOLE_OFF))
    )
    borne = {
        point: np.concatenate([force, np.zeros((2, n - force.shape[1], len(X)))], axis=1)
        for point, force in (("T", toe), ("S", sole))
    }
    found: dict[str, Array] = {}
    for link in MOVING:
        q, v, a = angle[link], rate[link], acceleration[link]
        found |= _from(1, f"rate_continuity[{link}, {{}}]", v[1:] - v[:-1] - a * STEP_S)  # (44)
        found |= _from(
            1, f"angle_continuity[{link}, {{}}]", q[1:] - q[:-1] - v[:-1] * STEP_S - a * STEP_S**2 / 2
        )  # (45)
        if link in ("UH", "AS", "ST"):
            found |= {f"foot_still[{link}, 0]": v[0], f"foot_still[{link}, {n}]": v[n]}
    found |= _from(1, "torso_still[UH, {}]", rate["UH"][1:n])
    found |= _from(1, "toe_flat[ST, {}]", angle["ST"][1 : SOLE_OFF + 1])
    found |= {f"foot_flat[{link}, {k}]": angle[link][k] for link in ("AS", "ST") for k in (0, n)}
    for knee, thigh, shank in (("knee", "HK", "KA"), ("knee'", "HK'", "K'A'")):
        found |= _from(0, f"knee[{knee}, {{}}]", angle[shank] - angle[thigh])

    places, speeds = _move(angle, rate)
    first, last = np.array([run, rise])[:, None], n
    for k, axis in enumerate("xz"):
        stands = places["T"][k] - (FOOT if axis == "x" else 0.0) + (run, rise)[k]
        found |= _from(1, f"toe_stands[{axis}, {{}}]", stands[1 : TOE_OFF + 1])
        found[f"ankle_on_step[{axis}, 0]"] = (places["A"][:, 0] + first)[k]
        found[f"ankle_on_step[{axis}, {n}]"] = (places["A"][:, last] - first)[k]
        found |= {f"ankle_still[{axis}, {i}]": speeds["A"][k, i] for i in (0, n)}
    for name, point in (("toe", "T"), ("sole", "S"), ("ankle", "A")):
        x, z = places[point]
        edges = sum(1.0 / (1.0 + np.exp(-(x + SETBACK + RESERVE - at) / EDGE)) for at in (0.0, run))
        height = z - rise * (edges - 1.0)
        found |= _from(TOE_OFF + 1, f"clearance_in_swing[{name}, {{}}]", height[TOE_OFF + 1 :])
        if name != "toe":
            found |= _from(0, f"clearance_in_support[{name}, {{}}]", height[:TOE_OFF])
    for leg, mark, level in (("stance", "'", 1), ("swing", "", 0), ("swing", "", 1)):
        low, high = places[f"A{mark}"], places[f"K{mark}"]
        edge = np.array([level * run - SETBACK, level * rise])[:, None, None]
        (x, z), (ahead, up) = edge - low, high - low
        before, above = (up * x - ahead * z) / RODS["KA"][0] - SHANK, -z
        outside = (before + above + np.sqrt((before - above) ** 2 + ROUNDING**2)) / 2
        found |= _from(0, f"shanks[{leg}, step {level}, {{}}]", outside)
    for part in ("next", "last"):
        (after, faster), torso = (
            _move(*({link: table(f"{kind}_{link}_{unit}[{{}}]", 1, part) for link in MOVING} for kind, unit in KINDS)),
            table("angle_UH_rad[{}]", 1, part)[0],
        )
        jumps = {
            "hip x": after["H"][0, 0] + run - places["H"][0, n],
            "hip z": after["H"][1, 0] + rise - places["H"][1, n],
            "hip speed x": faster["H"][0, 0] - speeds["H"][0, n],
            "hip speed z": faster["H"][1, 0] - speeds["H"][1, n],
            "torso": torso - angle["UH"][n],
        }
        found |= {f"meets_{part}[{name}, 0]": jump for name, jump in jumps.items()}

    q = {link: np.stack([angle[link][:n], rate[link][:n], acceleration[link]]) for link in MOVING}
    torque, turned, stance, pressure, _ = loads(q, borne)
    found |= ground_rows(stance, pressure, FRICTION, "friction_stance")
    found |= grip_rows(toe, FRICTION, "friction_toe") | grip_rows(sole, FRICTION, "friction_sole")
    squares = TORQUE_WEIGHT * sum((t**2).sum(axis=0) for t in torque.values())
    effort = STEP_S * (squares + ACCELERATION_WEIGHT * sum((a**2).sum(axis=0) for a in acceleration.values()))
    return {f"next_{name}": value for name, value in found.items()} | {"effort": effort}


def _move(angle: dict[str, Array], rate: dict[str, Array]) -> tuple[dict[str, Array], dict[str, Array]]:
    """Places and velocities (2, m, P) of all points, from the ankle that stands."""
    still = {link: np.stack([angle[link], 0.0 * angle[link], 0.0 * angle[link]]) for link in MOVING}
    places, speeds = loads(still, {}).places, {"A'": np.zeros((2, *angle["UH"].shape))}
    for near, far, link in (("A'", "K'", "K'A'"), ("K'", "H", "HK'"), ("H", "K", "HK"), ("K", "A", "KA")):
        x, z = places[far] - places[near]
        speeds[far] = speeds[near] + rate[link] * np.stack([z, -x])  # legs turn clockwise
    return places, speeds


def _from(first: int, form: str, values: Array) -> dict[str, Array]:
    """Values of successive instants by name."""
    return {form.format(first + k): value for k, value in enumerate(values)}
