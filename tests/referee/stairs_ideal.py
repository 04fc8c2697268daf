"""Trajectory optimisation of a step for many x at once: quantised dynamics (44), (45), and the loads of every interval."""

from collections.abc import Sequence

import numpy as np

from tests.referee.series import Array
from tests.referee.stairs import FOOT, FRICTION, MOVING, SETBACK, grip_rows, ground_rows, loads

INTERVALS, SOLE_OFF, TOE_OFF = 70, 10, 28  # t1 = 0.5 s and t2 = 1.4 s of 3.5 s (Table III)
STEP_S = 3.5 / INTERVALS
TORQUE_WEIGHT, ACCELERATION_WEIGHT = 0.01, 1e-3
EDGE, STANCE_FRICTION = 0.012, 10.0


def effort(X: Array, names: Sequence[str], length: float = 0.508, ratio: float = 0.70) -> dict[str, Array]:
    """Objective, rows and indexes by name, each (P,), at X (P, n) whose columns have these names."""
    column = {name: k for k, name in enumerate(names)}
    run, rise = length / 2, ratio * length / 2

    def table(form: str, count: int) -> Array:
        return np.stack([X[:, column[form.format(k)]] for k in range(count)])

    n = INTERVALS
    angle, rate = (
        {link: table(f"{kind}_{link}_{unit}[{{}}]", n + 1) for link in MOVING}
        for kind, unit in (("angle", "rad"), ("rate", "rad_s"))
    )
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
        found |= {f"rest[{link}, 0]": v[0], f"rest[{link}, {n}]": v[n]}
    found |= _from(1, "torso_still[UH, {}]", rate["UH"][1:n])
    found |= _from(1, "toe_flat[ST, {}]", angle["ST"][1 : SOLE_OFF + 1])
    found |= {f"foot_flat[{link}, {k}]": angle[link][k] for link in ("AS", "ST") for k in (0, n)}
    for knee, thigh, shank in (("knee", "HK", "KA"), ("knee'", "HK'", "K'A'")):
        found |= _from(0, f"knee[{knee}, {{}}]", angle[shank] - angle[thigh])

    still = {link: np.stack([angle[link], 0.0 * angle[link], 0.0 * angle[link]]) for link in MOVING}
    places = loads(still, {}).places
    first, last = np.array([run, rise])[:, None], n
    for k, axis in enumerate("xz"):
        stands = places["T"][k] - (FOOT if axis == "x" else 0.0) + (run, rise)[k]
        found |= _from(1, f"toe_stands[{axis}, {{}}]", stands[1 : TOE_OFF + 1])
        found[f"ankle_on_step[{axis}, 0]"] = (places["A"][:, 0] + first)[k]
        found[f"ankle_on_step[{axis}, {n}]"] = (places["A"][:, last] - first)[k]
        found[f"hip_advance[{axis}, {n}]"] = (places["H"][:, last] - places["H"][:, 0] - first)[k]
    for name, point in (("toe", "T"), ("sole", "S"), ("ankle", "A")):
        x, z = places[point]
        edges = sum(1.0 / (1.0 + np.exp(-(x + SETBACK - at) / EDGE)) for at in (0.0, run))
        height = z - rise * (edges - 1.0)
        found |= _from(TOE_OFF + 1, f"clearance_in_swing[{name}, {{}}]", height[TOE_OFF + 1 :])
        if name != "toe":
            found |= _from(0, f"clearance_in_support[{name}, {{}}]", height[:TOE_OFF])

    q = {link: np.stack([angle[link][:n], rate[link][:n], acceleration[link]]) for link in MOVING}
    torque, turned, stance, pressure, _ = loads(q, borne)
    found |= ground_rows(stance, pressure, STANCE_FRICTION, "friction_stance")
    found |= grip_rows(toe, FRICTION, "friction_toe") | grip_rows(sole, FRICTION, "friction_sole")
    squares = TORQUE_WEIGHT * sum((t**2).sum(axis=0) for t in torque.values())
    found["effort"] = STEP_S * (squares + ACCELERATION_WEIGHT * sum((a**2).sum(axis=0) for a in acceleration.values()))
    spin = {link: np.stack([angle[link], rate[link], 0.0 * rate[link]]) for link in MOVING}
    rates = {joint: value[1] for joint, value in loads(spin, {}).turned.items()}
    work = [np.abs(torque[j] * (rates[j][1:] + rates[j][:-1]) / 2).sum(axis=0) for j in torque]
    found["energy_J"] = STEP_S * sum(work)
    found["peak_torque_Nm"] = np.max([np.abs(t).max(axis=0) for t in torque.values()], axis=0)
    found["torso_pitch_rad"] = angle["UH"][0]
    return found


def _from(first: int, form: str, values: Array) -> dict[str, Array]:
    """Values of successive instants by name."""
    return {form.format(first + k): value for k, value in enumerate(values)}
