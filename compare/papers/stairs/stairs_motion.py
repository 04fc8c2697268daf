"""Motion of hip and both feet over a first step from standing, and over two steps on the stairs, for drawing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.planned_motion import Stair, ToeFoot, ankle, ankle_on_toe, foot_angles, hip, landed_angles
from nlp_gait.gaits.stairs.robot import toe_foot_biped
from nlp_gait.gaits.stairs.stair import GOVERNING, GRAVITY, make_stair_plan


@dataclass(frozen=True, kw_only=True, eq=False)
class Leg:
    """Joints of a leg, (m, 2) each [m]; origin at the rear ankle of the first step."""

    hip: Array
    knee: Array
    ankle: Array
    sole: Array
    toe: Array

    @property
    def lines(self) -> Array:
        """(m, 5, 2): hip, knee, ankle, sole, toe at every instant."""
        return np.stack([self.hip, self.knee, self.ankle, self.sole, self.toe], axis=1)


def first_step(plan: Mapping[str, float], tread: float, rise: float, times: Array) -> tuple[Leg, Leg]:
    """Swing and stance leg from standing to one step up, at a constant height of the hip; the feet start side by side."""
    found = _motion(plan, tread / 2, rise / 2, times)
    level = np.column_stack([found["hip"][:, 0] - found["hip"][0, 0], np.full(len(times), plan["hip_height_m"])])
    flat = np.zeros((len(times), 2))
    return _leg(level, found["ankle"], *found["angles"].T), _leg(level, flat, flat[:, 0], flat[:, 0])


def two_steps(plan: Mapping[str, float], tread: float, rise: float, times: Array) -> tuple[Leg, Leg]:
    """The leg that swings first and the other one: a whole step, then the next one with legs exchanged."""
    size, duration = np.array([tread, rise]), plan["t3_s"]
    first = _motion(plan, tread, rise, times[times < duration])
    second = _motion(plan, tread, rise, times[times >= duration] - duration)
    flat = np.tile(size, (len(first["hip"]), 1))
    at_hip = np.vstack([first["hip"], second["hip"] + size])
    swinging = _leg(
        at_hip,
        np.vstack([first["ankle"], second["landed"] + 2 * size]),
        *np.vstack([first["angles"], second["landed_angles"]]).T,
    )
    other = _leg(
        at_hip,
        np.vstack([flat, second["ankle"] + size]),
        *np.vstack([np.zeros_like(flat), second["angles"]]).T,
    )
    return swinging, other


def swing_leg(plan: Mapping[str, float], tread: float, rise: float, times: Array) -> tuple[Array, Array]:
    """Absolute angles (m, 2) of the swing thigh and shank [rad], and the vectors from hip to ankle (m, 2) [m]."""
    found = _motion(plan, tread, rise, times)
    leg = _leg(found["hip"], found["ankle"], *found["angles"].T)
    links = np.stack([leg.knee - leg.hip, leg.ankle - leg.knee], axis=1)
    return np.arctan2(-links[:, :, 1], links[:, :, 0]), leg.ankle - leg.hip


def _motion(plan: Mapping[str, float], tread: float, rise: float, times: Array) -> dict[str, Array]:
    ends = np.array([0.0, *(plan[name] for name in ("t1_s", "t2_s", "t_bc_s", "t3_s"))])
    s = np.clip((times - ends[:-1, None]) / np.diff(ends)[:, None], 0.0, 1.0)
    given = np.array([*(plan[name] for name in GOVERNING), tread, rise])
    found = _function().map(len(times))(s, np.tile(given[:, None], len(times)))
    names = ("hip", "ankle", "angles", "landed", "landed_angles")
    return {name: np.array(part).T for name, part in zip(names, found, strict=True)}


@cache
def _function() -> ca.Function:
    s, given = SX.sym("s", 4), SX.sym("given", len(GOVERNING) + 2)
    plan, stair = make_stair_plan(given[:-2]), Stair(given[-2], given[-1])
    robot = toe_foot_biped()
    foot = ToeFoot(robot.sole_m, robot.toe_m)
    landed = landed_angles(plan, s)
    outputs = [
        hip(plan, stair, GRAVITY, s),
        ankle(plan, stair, foot, s),
        ca.vertcat(*foot_angles(plan, s)),
        ankle_on_toe(foot, *landed),
        ca.vertcat(*landed),
    ]
    return ca.Function("motion", [s, given], outputs)


def _leg(at_hip: Array, at_ankle: Array, sole: Array, toe: Array) -> Leg:
    """Knee by the law of cosines, bent forward; sole joint and tip of the toe from their angles."""
    robot = toe_foot_biped()
    thigh, shank = robot.link("HK").length_m, robot.link("KA").length_m
    reach = at_ankle - at_hip
    distance = np.linalg.norm(reach, axis=1)
    along = (distance**2 + thigh**2 - shank**2) / (2 * distance)
    aside = np.sqrt(np.maximum(thigh**2 - along**2, 0.0))
    unit = reach / distance[:, None]
    forward = np.column_stack([-unit[:, 1], unit[:, 0]])
    at_sole = at_ankle + robot.sole_m * np.column_stack([np.cos(sole), -np.sin(sole)])
    return Leg(
        hip=at_hip,
        knee=at_hip + along[:, None] * unit + aside[:, None] * forward,
        ankle=at_ankle,
        sole=at_sole,
        toe=at_sole + robot.toe_m * np.column_stack([np.cos(toe), -np.sin(toe)]),
    )
