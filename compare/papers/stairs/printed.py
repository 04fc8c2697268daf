"""What the stairs paper prints, and how far its equations and our plans are from it: deterministic computations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from compare.papers.paper import read_rows
from compare.study.run import ProblemSpec
from nlp_gait.formulation import Array, Signals
from nlp_gait.formulation.display import LEFT, RIGHT
from nlp_gait.gaits.stairs.closed_loop import QUANTUM, ClosedLoop, N, measure_joints
from nlp_gait.gaits.stairs.leg_network import LEGS, NetworkSettings, compute_leg_vector, make_training_path
from nlp_gait.gaits.stairs.planar_biped import GRAVITY, get_rod, load_toe_foot_biped, make_dynamics
from nlp_gait.gaits.stairs.stair import SETBACK
from nlp_gait.symbolic.nonsmooth import Exact

POSTURES = 20  # at which dynamics are evaluated
DENSITY = 5  # samples of a measured plan, as a multiple of the problem's own


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A column of Table IV; cost and energy have no unit in the paper."""

    stair_length_m: float  # of a double step
    rise_run_ratio: float
    acceleration: float  # largest, printed in m/s^2, of joint angles [rad/s^2]
    jerk: float  # largest, printed in m/s^3 [rad/s^3]
    torso_pitch_rad: float  # q5
    kp: float  # K_p
    kd: float  # K_d
    cost: float  # of (53)
    energy: float  # total consumption
    peak_torque_Nm: float

    @property
    def step_m(self) -> tuple[float, float]:
        """Tread and rise of one step."""
        return self.stair_length_m / 2, self.stair_length_m / 2 * self.rise_run_ratio

    @property
    def stair(self) -> dict[str, float]:
        """Parameters of a problem."""
        return {"stair_length_m": self.stair_length_m, "rise_run_ratio": self.rise_run_ratio}


FOLDER = Path(__file__).parent
TABLE_3 = {row["parameter"]: float(row["value"]) for row in read_rows(FOLDER / "table_3.csv")}
TABLE_4 = {
    int(row.pop("case")): Case(**{name: float(value) for name, value in row.items()})
    for row in read_rows(FOLDER / "table_4.csv")
}


def measure_equations(case: Case) -> dict[str, dict[str, float]]:
    """Return by how much the printed equations miss in a case, with the values of Table III, by the id of the difference."""
    robot, (tread, rise) = load_toe_foot_biped(), case.step_m
    names = ("t1_s", "t2_s", "t_bc_s", "sole_angle_rad", "toe_angle_rad", "catch_angle_rad")
    t1, t2, t_bc, sole, toe, catch = (TABLE_3[name] for name in names)
    lift = np.array([robot.toe_m * (1 - math.cos(toe)), robot.toe_m * math.sin(toe)])  # (eqs. 1, 2) at t2
    distance = 2 * tread - lift[0]
    first = _find_cycloid_angle(rise, math.pi * rise - distance)  # (eq. 7)

    def cycloid(angle: float) -> Array:  # (eqs. 5, 6), ends at 2 tread
        x = 2 * tread + rise * (angle - math.sin(angle) - math.pi)
        return np.array([x, lift[1] + rise * (1 - math.cos(angle))])

    second = lift + [0.0, rise * (1 - math.cos(first))]
    points = np.stack([lift, second, cycloid(first + catch), cycloid(first + 2 * catch)])
    s = np.linspace(0.0, 1.0, 1001)[:, None]
    weights = np.hstack([(1 - s) ** 3, (1 - s) ** 2 * s, (1 - s) * s**2, s**3])
    sixth, seventh = (
        [angle * (offset + 12 * u - 9 * u**2 + 2 * u**3) for u in (t1 / (t2 - t1), t2 / (t2 - t1))]
        for angle, offset in ((sole, -4), (toe, -5))
    )
    bridge = np.linalg.norm((weights - weights * [1, 3, 3, 1]) @ points, axis=1).max()  # (10), (11)
    return {
        "foot-angles": {
            "jump of the sole at t1 [degrees]": math.degrees(sixth[0] - sole),  # (eq. 3)
            "sole at t2, level in print [degrees]": math.degrees(sixth[1]),
            f"toe at t2, {math.degrees(toe):.0f} in print [degrees]": math.degrees(seventh[1]),  # (eq. 4)
        },
        "bezier": {
            "curve off by up to [mm]": 1e3 * float(bridge),
            "jump of the ankle's speed at t2 [m/s]": 3 * float(np.linalg.norm(points[1] - points[0])) / (t_bc - t2),
        },
        "arc": {"hip above its place [m]": tread / math.sin(2 * math.atan2(rise, tread))},  # (eq. 25)
        "cubic": _measure_cubic(rise, 3 * catch / (t_bc - t2), first + 2 * catch, t_bc),
    }


def _measure_cubic(radius: float, rate: float, first: float, t_bc: float) -> dict[str, float]:
    """Return how far the angle of (13), (14) runs backwards from where the cycloid is caught at a rate [rad, rad/s]."""
    end, t3 = math.sqrt(GRAVITY / radius), TABLE_3["t3_s"]
    rows = [[t**n for n in range(4)] for t in (t_bc, t3)] + [
        [n * t ** max(n - 1, 0) for n in range(4)] for t in (t_bc, t3)
    ]
    times = np.linspace(t_bc, t3, 1001)
    angle = np.linalg.solve(np.array(rows), [first, math.pi, rate, end]) @ times ** np.arange(4)[:, None]
    return {"angle where the cycloid is caught [rad]": first, "least angle afterwards [rad]": float(angle.min())}


def measure_dynamics() -> tuple[float, float]:
    """Return the least eigenvalue of M over its largest, and how far dM/dt - 2 C is from skew, at random postures."""
    q, v, rng = ca.SX.sym("q", N), ca.SX.sym("v", N), np.random.default_rng(0)
    motion = make_dynamics(q, v, q, "H")
    rate = ca.reshape(ca.jtimes(ca.vec(motion.M), q, v), N, N) - 2 * motion.C
    function = ca.Function("dynamics", [q, v], [motion.M, rate + rate.T])
    least, skew = math.inf, 0.0
    for _ in range(POSTURES):
        M, symmetric = (np.array(value) for value in function(rng.uniform(-np.pi, np.pi, N), rng.uniform(-3, 3, N)))
        eigenvalues = np.linalg.eigvalsh(M)
        least, skew = min(least, eigenvalues[0] / eigenvalues[-1]), max(skew, float(np.abs(symmetric).max()))
    return least, skew


def _find_cycloid_angle(radius: float, x: float) -> float:
    angles = np.linspace(0.0, math.pi, 100_001)
    return float(np.interp(x, radius * (angles - np.sin(angles)), angles))


def move(spec: ProblemSpec, x: Mapping[str, float]) -> tuple[Signals, dict[str, Array]]:
    """Return the motion of a plan, and by leg its hip, knee, ankle, sole and toe in the sagittal plane (T, 5, 2) [m]."""
    problem = spec.load().dense(DENSITY)
    if problem is None or problem.display.skeleton is None:
        raise TypeError("the planner has samples and a skeleton")
    signals = problem.signals(problem.check_x(x))
    skeleton = problem.display.skeleton(signals, {p.name: problem.value(p.name) for p in problem.parameters})
    return signals, {limb.side: limb.points[:, :, [0, 2]] for limb in skeleton.limbs if limb.side in (LEFT, RIGHT)}


def measure_depths(case: Case, legs: Mapping[str, Array], lifted: Array) -> tuple[float, float]:
    """Return how deep the swing foot, once ``lifted`` (T,), and the shanks are inside the steps [mm]; negative above."""
    tread, rise = case.step_m
    x, z = np.moveaxis(legs[RIGHT][lifted, 2:5], -1, 0)
    ground = rise * (1.0 * (x >= -SETBACK) + (x >= tread - SETBACK) - 1.0)
    shank = -math.inf
    for leg in legs.values():
        (x0, z0), (x1, z1) = (leg[:, i].T for i in (2, 1))  # ankle and knee
        for edge_x, edge_z in ((tread - SETBACK, rise), (-SETBACK, 0.0)):
            share = (edge_x - x0) / np.where(np.abs(x1 - x0) > 1e-9, x1 - x0, np.inf)
            below = edge_z - (z0 + share * (z1 - z0))
            shank = max(shank, float(np.max(np.where((share > 0) & (share < 1), below, -np.inf))))
    return round(1e3 * float((ground - z).max()), 1) + 0.0, round(1e3 * shank, 1)


def compute_desired_angles(spec: ProblemSpec, torso_pitch_rad: float) -> Array:
    """Return the angles of all links (m + 1, 9) that a tracked step follows, every 0.01 s [rad]."""
    point = spec.load().at([1.0, 1.0, torso_pitch_rad])
    return np.array(ca.evalf(ClosedLoop(quanta=350).inputs(point, Exact())[0])).T[:, :N]


def measure_peaks(spec: ProblemSpec, torso_pitch_rad: float) -> tuple[float, float]:
    """Return the largest acceleration [rad/s^2] and jerk [rad/s^3] of the printed joint angles, by differences over 0.01 s."""
    angles = compute_desired_angles(spec, torso_pitch_rad) @ measure_joints("printed").full().T
    second, third = (float(np.abs(np.diff(angles, n, axis=0)).max()) / QUANTUM**n for n in (2, 3))
    return second, third


def train_network(
    spec: ProblemSpec, torso_pitch_rad: float, rates: Sequence[tuple[float, float]], poses: int
) -> list[dict[str, Any]]:
    """Return how the network learns the first poses of the swing leg at rates, each with the units of length in a metre."""
    angles = compute_desired_angles(spec, torso_pitch_rad)[:poses, :2]
    lengths = [get_rod(link).length_m for link in LEGS[0]]
    legs = np.hstack([np.array(ca.evalf(compute_leg_vector(ca.SX(ca.DM(row)), *lengths))) for row in angles])
    rows = []
    for rate, unit in rates:
        settings = NetworkSettings(rate=rate)
        train = make_training_path(settings, unit * lengths[0], unit * lengths[1], poses)
        _, errors, steps = (np.array(values) for values in train(settings.first_weights, unit * legs))
        converged = errors[0] <= settings.tolerance_m2
        numbers = {"converged_%": 100 * float(converged.mean()), "later_converged_%": 100 * float(converged[1:].mean())}
        numbers |= {"first_steps": float(steps[0, 0]), "later_steps": float(np.median(steps[0, 1:]))}
        rows.append({**numbers, "steps": steps[0].tolist()})
    return rows
