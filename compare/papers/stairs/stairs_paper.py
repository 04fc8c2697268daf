"""Tables III and IV of Bhardwaj, Mishra, Sukavanam and Balasubramanian, as printed (``stairs_paper.toml``).

How plans and the tracked step may be read (``stairs_plan_choices.toml``, ``stairs_choices.toml``), and by how much the printed
equations miss.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from compare.papers.claims import read_printed, read_tables
from nlp_gait.decoding import decode
from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.planar_biped import GRAVITY, load_toe_foot_biped
from nlp_gait.gaits.stairs.stair import SETBACK

OURS, FREE, PRINTED = "ours", "free", "printed"  # readings of the tracked step


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A column of Table IV; cost and energy have no unit in the paper."""

    stair_length_m: float  # of a double step
    rise_run_ratio: float  # rise over run
    acceleration: float  # largest, printed in m/s^2, of joint angles [rad/s^2]
    jerk: float  # largest, printed in m/s^3 [rad/s^3]
    torso_pitch_rad: float  # q5
    kp: float  # K_p
    kd: float  # K_d
    cost: float  # of (53)
    energy: float  # total consumption
    peak_torque_Nm: float  # largest torque

    @property
    def step_m(self) -> tuple[float, float]:
        """Tread and rise of one step."""
        return self.stair_length_m / 2, self.stair_length_m / 2 * self.rise_run_ratio


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A reading of the planner or of the tracked step: options and values of the problem; the plan that is followed."""

    text: str
    plan: str = "plan"
    relaxes: bool = False  # whether it only relaxes limits of the planner, so that our plans keep them
    #: readings of the tracked step with the same objective, narrower bounds or more limits
    contains: tuple[str, ...] = ()
    options: Mapping[str, str | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class StairsPaper:
    """Content of ``stairs_paper.toml``."""

    table_3: Mapping[str, float]  # governing parameters under the names of the problem
    table_4: tuple[Case, ...]
    rows: Mapping[str, str]  # words for the quantities of Table IV
    effects: Mapping[str, str]  # texts for indexes of a tracked step
    ants: int
    iterations: int
    evaporation: float


PAPER = read_printed(StairsPaper, "stairs/stairs_paper.toml")
TABLE_3, TABLE_4 = PAPER.table_3, dict(enumerate(PAPER.table_4, 1))
ANTS, ITERATIONS, EVAPORATION = PAPER.ants, PAPER.iterations, PAPER.evaporation
CHOICES = {name: decode(Reading, row) for name, row in read_tables("stairs/stairs_choices.toml").items()}
INSTANTS = (OURS, FREE, PRINTED)  # with which Algorithm 4 runs
PLAN_CHOICES = {name: decode(Reading, row) for name, row in read_tables("stairs/stairs_plan_choices.toml").items()}


def measure_printed_equations(case: Case, ankle: Array) -> dict[str, float]:
    """Return the misses of the printed equations in one case.

    For the printed pose of the foot, ankle (m, 2) is the path of our swing ankle through the air from the stance ankle [m].
    """
    robot, (tread, rise) = load_toe_foot_biped(), case.step_m
    t1, t2, t_bc, sole, toe, catch = (
        TABLE_3[name] for name in ("t1_s", "t2_s", "t_bc_s", "sole_angle_rad", "toe_angle_rad", "catch_angle_rad")
    )
    lift = np.array([robot.toe_m * (1 - math.cos(toe)), robot.toe_m * math.sin(toe)])  # (eqs. 1, 2) at t2
    radius, distance = rise, 2 * tread - lift[0]
    angles = np.linspace(0.0, math.pi, 100_001)
    first = float(np.interp(math.pi * radius - distance, radius * (angles - np.sin(angles)), angles))  # (eq. 7)

    def cycloid(angle: float) -> Array:  # (eqs. 5, 6), ends at 2 tread
        x = 2 * tread + radius * (angle - math.sin(angle) - math.pi)
        return np.array([x, lift[1] + radius * (1 - math.cos(angle))])

    caught = first + 2 * catch
    second = lift + [0.0, radius * (1 - math.cos(first))]
    points = np.stack([lift, second, cycloid(first + catch), cycloid(caught)])
    slope = radius * np.array([1 - math.cos(caught), math.sin(caught)])  # of the cycloid
    s = np.linspace(0.0, 1.0, 1001)[:, None]
    weights = np.hstack([(1 - s) ** 3, (1 - s) ** 2 * s, (1 - s) * s**2, s**3])
    printed, proper = weights @ points, (weights * [1, 3, 3, 1]) @ points
    end_rate = math.sqrt(GRAVITY / radius)
    place = ankle + [robot.sole_m + robot.toe_m * math.cos(toe), -robot.toe_m * math.sin(toe)]  # tip of the toe
    ground = rise * ((place[:, 0] >= -SETBACK) + (place[:, 0] >= tread - SETBACK) - 1.0)
    sixth, seventh = (
        [angle * (offset + 12 * u - 9 * u**2 + 2 * u**3) for u in (t1 / (t2 - t1), t2 / (t2 - t1))]
        for angle, offset in ((sole, -4), (toe, -5))
    )
    slant = math.atan2(rise, tread)
    arc = tread / math.sin(2 * slant)  # (eq. 25)
    return {
        "sole_jump_deg": math.degrees(sixth[0] - sole),  # (eq. 3) at t1
        "sole_end_deg": math.degrees(sixth[1]),  # at t2, where the sole should be level
        "toe_jump_deg": math.degrees(seventh[0]),  # (eq. 4) at t1
        "toe_end_deg": math.degrees(seventh[1]),  # at t2, where it should be theta_b
        "landing_mm": 1e3 * lift[0],  # (eq. 7)
        "bridge_mm": 1e3 * float(np.linalg.norm(printed - proper, axis=1).max()),  # (eqs. 10, 11)
        "lift_off_m_s": 3 * float(np.linalg.norm(points[1] - points[0])) / (t_bc - t2),
        "end_rate_rad_s": end_rate,
        "landing_m_s": 2 * radius * end_rate,
        "toe_depth_mm": 1e3 * float((ground - place[:, 1]).max()),  # (eqs. 15-20)
        "toe_jump_mm": 1e3 * lift[1],  # (eq. 16) with theta_6 = 0
        "raised_toe_mm": 1e3 * (lift[1] + robot.foot_m * math.sin(toe)),  # with theta_6 = theta_b
        "third_point_mm": 1e3 * math.dist(points[2], points[3] - catch * slope),
        "arc_m": arc,
        "sagitta_mm": 1e3 * arc * (1 - math.cos(slant)),  # from the arc to its chord
    }


def measure_slide(tread: float, rise: float) -> float:
    """Return how deep the printed ankle is inside the first step of a flat stair at its edge, by (8), (9) [mm]."""
    past = tread - SETBACK - max(2 * tread - math.pi * rise, 0.0)  # of the cycloid, at the edge
    angles = np.linspace(0.0, math.pi, 100_001)
    angle = float(np.interp(past, rise * (angles - np.sin(angles)), angles))
    lift = load_toe_foot_biped().toe_m * math.sin(TABLE_3["toe_angle_rad"])
    flat = math.pi * rise < 2 * tread
    return 1e3 * max(rise - lift - rise * (1 - math.cos(angle)), 0.0) * flat
