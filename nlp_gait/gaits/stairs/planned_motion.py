"""The planned step of Bhardwaj et al.: curves of feet, ankle and hip over time, and the link angles that follow from them."""

from collections.abc import Mapping
from typing import Generic, Literal, NamedTuple, TypeVar

import casadi as ca
from casadi import SX

from nlp_gait.gaits.stairs.planar_biped import GRAVITY, get_rod
from nlp_gait.symbolic.kinematics import leg_angles
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, stack

PHASES = ("heel rises", "sole rises", "catch the cycloid", "track the cycloid")
LEAST_DURATION = 1e-3  # [s]
# Half of a shank's thickness, with 5 mm in reserve for the motion between samples [m]; and the width over which a limit on its
# distance from an edge passes into one on the ankle's height above it [m].
SHANK_RADIUS, SHANK_ROUNDING = 0.025, 0.005
# Newton steps for the cycloid's first angle; from the cube root as guess, five reach machine precision.
_NEWTON_STEPS = 6
# Flat stairs begin their cycloid at its first point, where the root has no slope: at 2e-5 rad instead.
_LEAST_CYCLOID_ARGUMENT = 1e-15
_LEAST_ROOT_SQUARED = 1e-6  # keeps the arc's root and slopes finite where a bad plan leaves the arc [m^2]
# Time exceeds t3 only in plans whose knots are out of order; more than this beyond t3, the hip no longer advances [s].
_LATEST = 1.0

E = TypeVar("E")
StepKind = Literal["next", "first"]
"""Which ground a step passes: ``next`` within the stairs, or ``first`` from the floor before them."""


class Stair(NamedTuple, Generic[E]):
    """Two equal steps; the stance ankle stands at the origin, the rear ankle one tread back and one rise down."""

    tread: E  # X, from ankle to ankle of neighbouring steps [m]
    rise: E  # Z, of one step [m]


class StairPlan(NamedTuple):
    """Governing parameters of a step (Tables III and IV)."""

    hip_height: SX  # z_Ci, of the hip above the rear ankle at the start [m]
    hip_start: SX  # x of the hip at the start, from the rear ankle [m]
    zmp_start: SX  # planned ZMP at the start, from the rear ankle [m]
    zmp_end: SX  # planned ZMP at the end, from the stance ankle [m]
    end_rate: SX  # rate of the cycloid's angle at the end [rad/s]
    torso_pitch: SX  # from the forward axis, counter-clockwise [rad]
    t1: SX  # end of the first phase [s]
    t2: SX  # end of the double support [s]
    t_bc: SX  # end of the Bezier bridge [s]
    foot_pitch: SX  # upward pitch of the foot while it tracks the cycloid [rad]
    t3: SX  # end of the step [s]
    sole_angle: SX  # theta_a, largest angle of the sole [rad]
    toe_angle: SX  # theta_b, of the toe at the end of the double support [rad]
    catch_angle: SX  # Delta theta_c0, half of what the bridge covers on the cycloid [rad]

    @property
    def durations(self) -> SX:
        """(4,) of the phases [s]; a phase of no or negative duration counts as a millisecond."""
        ends = ca.vertcat(0, self.t1, self.t2, self.t_bc, self.t3)
        return ca.fmax(ends[1:] - ends[:-1], LEAST_DURATION)


def compute_stair_height(x: SX, stair: Stair[SX], setback: float, width: float, step: StepKind = "next") -> SX:
    """Return the height of the ground under a point at x, relative to the stance ankle [m].

    The edge of each step is ``setback`` behind the ankle that stands on it; half of its rise happens within 2.2 widths [m].
    Below the first step there is only floor.
    """

    def smooth_edge(place: SX | float) -> SX:
        return 0.5 * (1 + ca.tanh((x - place + setback) / (2 * width)))

    if step == "first":
        return stair.rise * smooth_edge(stair.tread)
    return stair.rise * (smooth_edge(0.0) + smooth_edge(stair.tread) - 1)


def compute_heights(
    points: Mapping[str, SX], stair: Stair[SX], setback: float, width: float, step: StepKind = "next"
) -> SX:
    """Return the heights (3,) of toe, sole and ankle of the swing foot above the stair [m], see ``compute_stair_height``."""
    places = (points[name] for name in "TSA")
    return ca.vertcat(*(place[1] - compute_stair_height(place[0], stair, setback, width, step) for place in places))


def compute_shank_gaps(points: Mapping[str, SX], stair: Stair[SX], setback: float, step: StepKind = "next") -> SX:
    """Return by how much the shanks stay outside the edges of the steps ahead of them (g,) [m], see ``list_shank_edges``.

    A shank is far enough before an edge, or its ankle is above it.
    """
    gaps = []
    for mark, level in list_shank_edges(step):
        ankle, knee = points[f"A{mark}"], points[f"K{mark}"]
        edge = ca.vertcat(level * stair.tread - setback, level * stair.rise)
        along, ahead = knee - ankle, edge - ankle
        before = (along[1] * ahead[0] - along[0] * ahead[1]) / get_rod("KA").length_m - SHANK_RADIUS
        above = -ahead[1]
        gaps.append((before + above + ca.sqrt((before - above) ** 2 + SHANK_ROUNDING**2)) / 2)
    return ca.vertcat(*gaps)


def list_shank_edges(step: StepKind) -> tuple[tuple[str, int], ...]:
    """Return legs, primed the stance leg, and the edges that their shanks may meet: 1 ahead of the stance foot, 0 behind it."""
    return (("'", 1), ("", 1)) if step == "first" else (("'", 1), ("", 0), ("", 1))


def compute_foot_angles(plan: StairPlan, s: SX) -> tuple[SX, SX]:
    """Angles of sole and toe, theta_6 and theta_7 [rad], from the fractions s (4,) of the phases.

    In the air the foot straightens and pitches up by ``foot_pitch``, and lands as it left: toe first.

    Source:
        Bhardwaj et al., eqs. (3), (4), with (t - t1) / (t2 - t1) as argument of the second piece: as printed they are
        continuous only if t2 = 2 t1. In the air eq. (20) holds theta_6 = 0 and theta_7 = theta_b, with which the toe cuts
        through the edge of both steps; eqs. (15)-(18) have a straight foot.
    """
    straight = _smooth(s[2]) - s[3] ** 4 * (5 - 4 * s[3])
    sole = plan.sole_angle * (_smooth(s[0]) - _smooth(s[1]))  # (eq. 3)
    toe = plan.toe_angle * _smooth(s[1])  # (eq. 4)
    return sole - straight * plan.foot_pitch, toe - straight * (plan.toe_angle + plan.foot_pitch)


def locate_ankle_on_toe(sole: SX, toe: SX) -> SX:
    """Return the ankle (2,) relative to its position with a flat foot [m], while the tip of the toe stands still."""
    sole_m, toe_m = get_rod("AS").length_m, get_rod("ST").length_m
    ahead = sole_m * (1 - ca.cos(sole)) + toe_m * (1 - ca.cos(toe))  # (eq. 1)
    return ca.vertcat(ahead, sole_m * ca.sin(sole) + toe_m * ca.sin(toe))  # (eq. 2)


def locate_ankle(plan: StairPlan, stair: Stair[SX], s: SX) -> SX:
    """(2,) position of the swing ankle [m], from the fractions s (4,) of the phases.

    Source:
        Bhardwaj et al., eqs. (1), (2), (5)-(14). Changed: the Bezier curve has its binomial factors, its third control point
        lies on the cycloid's tangent and its argument is 2 u^2 - u^3, so that the velocity is continuous at both ends; the
        cycloid ends so far ahead that the foot, once flat, stands exactly two treads on. Where pi r is less than the distance
        the printed foot slides along the ground first, into the edge of the step; here the cycloid is stretched instead.
    """
    rising = locate_ankle_on_toe(*compute_foot_angles(plan, ca.vertcat(s[:2], 0, 0)))
    lift_off = locate_ankle_on_toe(SX(0), plan.toe_angle)
    radius = stair.rise  # half of the double rise
    distance = 2 * stair.tread
    # A stair flatter than 2 / pi stretches the cycloid over the whole distance.
    width = ca.fmax(radius, distance / ca.pi)
    first = _find_cycloid_angle(ca.pi - distance / width)
    caught = first + 2 * plan.catch_angle

    def cycloid(angle: SX) -> SX:
        x = distance + width * (angle - ca.sin(angle) - ca.pi)  # (eqs. 5, 7)
        return lift_off + ca.vertcat(x, radius * (1 - ca.cos(angle)))  # (eq. 6)

    p1, p4 = lift_off, cycloid(caught)
    p2 = lift_off + ca.vertcat(0, radius * (1 - ca.cos(first)))  # (eqs. 8, 9)
    p3 = p4 - plan.catch_angle * ca.vertcat(width * (1 - ca.cos(caught)), radius * ca.sin(caught))
    b = s[2] ** 2 * (2 - s[2])
    bridge = (1 - b) ** 3 * p1 + 3 * (1 - b) ** 2 * b * p2 + 3 * (1 - b) * b**2 * p3 + b**3 * p4  # (eqs. 10, 11)

    # Angle of the cycloid: cubic from the bridge's end velocity to the end rate (eqs. 12-14).
    _, _, bridge_time, track_time = ca.vertsplit(plan.durations)
    start_rate = 3 * plan.catch_angle / bridge_time
    v0, v1, rise = start_rate * track_time, plan.end_rate * track_time, ca.pi - caught
    c = s[3]
    angle = caught + c * (v0 + c * (3 * rise - 2 * v0 - v1 + c * (v0 + v1 - 2 * rise)))
    return rising + (bridge - p1) + (cycloid(angle) - p4)


def locate_hip(plan: StairPlan, stair: Stair[SX], s: SX) -> SX:
    """(2,) position of the hip [m], from the fractions s (4,) of the phases.

    Source:
        Bhardwaj et al., eqs. (21)-(26), with the arc of (25) as z_Ci + R - sqrt(R^2 - (x - x_start)^2): as printed it does
        not pass through its own ends.
    """
    t = ca.dot(plan.durations, s)
    rate = ca.sqrt(GRAVITY / plan.hip_height)  # (eq. 24)
    first, last, zmp_last = plan.hip_start, plan.hip_start + stair.tread, stair.tread + plan.zmp_end
    planned_rise = zmp_last - plan.zmp_start
    a2, a3 = 3 * planned_rise / plan.t3**2, -2 * planned_rise / plan.t3**3  # (eq. 26)

    def particular(time: SX) -> SX:
        return plan.zmp_start + a2 * time**2 + a3 * time**3 + (6 * a3 * time + 2 * a2) / rate**2  # (eq. 23)

    start = first - particular(SX(0))
    end = last - particular(plan.t3)
    # C1 exp(w t) + C2 exp(-w t), written so that neither exponential is large.
    fading = ca.exp(-rate * plan.t3)
    ahead = (end - start * fading) / (1 - fading**2)
    behind = (start - end * fading) / (1 - fading**2)
    x = particular(t) + ahead * ca.exp(rate * ca.fmin(t - plan.t3, _LATEST)) + behind * ca.exp(-rate * t)

    arc = 2 * ca.atan2(stair.rise, stair.tread)
    radius = stair.tread / ca.sin(arc)
    root = ca.sqrt(ca.fmax(radius**2 - (x - plan.hip_start) ** 2, _LEAST_ROOT_SQUARED))
    return ca.vertcat(x, plan.hip_height + radius - root)  # (eq. 25)


def move_in_time(position: SX, s: SX, rates: SX) -> Motion:
    """Motion of a position that depends on the fractions s (4,), which pass at constant ``rates`` (4,) [1/s]."""
    velocity = ca.jtimes(position, s, rates)
    return Motion(position, velocity, ca.jtimes(velocity, s, rates))


def _smooth(s: SX) -> SX:
    """Cubic from 0 to 1 at rest at both ends."""
    return s**2 * (3 - 2 * s)


def _find_cycloid_angle(m: SX) -> SX:
    """Root of theta - sin theta = m by Newton's method; all but 0 where m is negative (eq. 7)."""
    m = ca.fmax(m, _LEAST_CYCLOID_ARGUMENT)
    theta = (6 * m) ** (1 / 3)
    for _ in range(_NEWTON_STEPS):
        theta = theta - (theta - ca.sin(theta) - m) / (1 - ca.cos(theta))
    return theta


class Posture(NamedTuple):
    """Planned motion of the whole robot at one instant, origin at the ankle of the stance foot when it is flat."""

    q: Motion  # (7,) absolute link angles in the order of ``loads.MOVING`` [rad], with rates and accelerations
    reach: SX  # (2,) cosines of the swing and the stance knee: above 1 the ankle is out of reach
    hip: Motion  # (2,) [m]
    ankle: Motion  # (2,) of the swing leg [m]


def compute_posture(plan: StairPlan, stair: Stair[SX], s: SX, rates: SX, margin: SX, ops: Nonsmooth) -> Posture:
    """Return the posture at symbols s (4,), shares of the phases with rates 1 / duration or 0; margin of a knee's cosine."""
    stance = ca.vertcat(stair.tread, stair.rise)  # of the stance ankle from the rear one
    at_hip = move_in_time(locate_hip(plan, stair, s) - stance, s, rates)
    at_ankle = move_in_time(locate_ankle(plan, stair, s) - stance, s, rates)
    stands = Motion(SX(2, 1), SX(2, 1), SX(2, 1))  # the stance ankle
    swing, swing_reach = _solve_leg(at_hip, at_ankle, margin, ops)
    support, support_reach = _solve_leg(at_hip, stands, margin, ops)
    feet = move_in_time(ca.vertcat(*compute_foot_angles(plan, s)), s, rates)
    torso = constant_motion(0.0)._replace(position=plan.torso_pitch)
    reach = ca.vertcat(swing_reach, support_reach)
    return Posture(stack(swing, support, torso, feet), reach, at_hip, at_ankle)


def _solve_leg(at_hip: Motion, at_ankle: Motion, margin: SX, ops: Nonsmooth) -> tuple[Motion, SX]:
    """Absolute angles of thigh and shank, and the cosine of the knee."""
    forward_up = (ankle_part - hip_part for ankle_part, hip_part in zip(at_ankle, at_hip, strict=True))
    hip_to_ankle = Motion(*(ca.vertcat(order[0], 0, order[1]) for order in forward_up))
    leg = leg_angles(hip_to_ankle, get_rod("HK").length_m, get_rod("KA").length_m, margin, ops)
    _, pitch, knee, _, _ = (Motion(*(order[i] for order in leg.joints)) for i in range(5))
    upright = constant_motion(ca.pi / 2)  # a leg that hangs down
    return stack(add_motions(pitch, upright), add_motions(add_motions(pitch, knee), upright)), leg.knee_cosine
