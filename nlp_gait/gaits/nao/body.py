"""NAO as its gaits take it: its joints, its closed-form legs under an upright torso, the swing of its arms."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from casadi import DM, MX, SX, vertcat

from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import InstantPoint, Point
from nlp_gait.formulation.added_limits import AddedLimits, parse_limits
from nlp_gait.gaits.biped.body import Angles, Body, Coordinate, Support, ZmpGravity, ZmpMasses
from nlp_gait.gaits.biped.footholds import Foothold
from nlp_gait.gaits.biped.limits import ArmLimits, Limit, Margins
from nlp_gait.gaits.biped.samples import Instant
from nlp_gait.robots import Joint, Robot, load_robot
from nlp_gait.robots.robot import Vector
from nlp_gait.robots.tree import find_partner, make_point_masses, weld
from nlp_gait.symbolic.kinematics import FORWARD, TO_THE_LEFT, leg_angles
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion, cubic

LEG_JOINTS = ("HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
ARM_JOINTS = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw")
YAW_PITCHES = ("LHipYawPitch", "RHipYawPitch")
# Joints that enter the power (eq. 32): both legs with the hip yaw-pitch, and both arms.
JOINTS = tuple(
    f"{side}{joint}" for names in (("HipYawPitch", *LEG_JOINTS), ARM_JOINTS) for side in "LR" for joint in names
)
PLANNED_JOINTS = tuple(f"{side}{joint}" for side in "LR" for joint in LEG_JOINTS)
KNEES = ("LKneePitch", "RKneePitch")
# Section 3.1 [rad].
HELD_ARM_ANGLES = {
    "LShoulderRoll": 0.26,
    "RShoulderRoll": -0.26,
    "LElbowYaw": -1.5,
    "RElbowYaw": 1.5,
    "LWristYaw": 0.0,
    "RWristYaw": 0.0,
}
# All joints of arms that do not swing: in the middle of Table 3.
RESTING_ARM_ANGLES = HELD_ARM_ANGLES | {
    "LShoulderPitch": 1.5,
    "RShoulderPitch": 1.5,
    "LElbowRoll": -0.53,
    "RElbowRoll": 0.53,
}

# The axis about which each joint must turn.
AXES = dict(zip(LEG_JOINTS, (FORWARD, TO_THE_LEFT, TO_THE_LEFT, TO_THE_LEFT, FORWARD), strict=True))
CROSSING = ("HipPitch", "AnkleRoll")  # joints whose axis crosses that of the joint before them
BELOW = ("KneePitch", "AnklePitch")  # joints that are straight below the one before them

# Published axes and origins are rounded: 1e-3 rad and 0.1 mm move a foot by less than the 4 mm by which margins reproduce.
AXIS_TOLERANCE, ORIGIN_TOLERANCE_M = 1e-3, 1e-4


class LegGeometry(NamedTuple):
    """Lengths of one leg."""

    hip_m: Vector  # (3,) centre of the hip joints from the torso's origin
    thigh_m: float  # hip to knee
    tibia_m: float  # knee to ankle
    ankle_height_m: float  # ankle above the ground


def measure_leg(robot: Robot, side: str) -> LegGeometry:
    """Measure the leg on side ``"L"`` or ``"R"``; raises InputError if the closed form does not solve it, or UnknownNameError."""
    joints = {name: robot.joint(f"{side}{name}") for name in ("HipYawPitch", *LEG_JOINTS)}
    above = robot.root
    for name, joint in joints.items():
        if (wrong := _find_misfit(name, joint, above)) is not None:
            raise InputError(
                f"robot {robot.name!r}, joint {joint.name!r}: its {wrong}. The legs that are solved in closed form are chains "
                f"{' - '.join(joints)} from the torso, whose hips and ankles have no offsets"
            )
        above = joint.child
    name = "left" if side == "L" else "right"
    foot = robot.feet[name]
    if foot.link != above:
        raise InputError(f"robot {robot.name!r}, foot {name!r}: its link must be {above!r}, got {foot.link!r}")
    yaw, roll, _, knee, ankle, _ = (joint.origin_m for joint in joints.values())
    hip = yaw[0] + roll[0], yaw[1] + roll[1], yaw[2] + roll[2]
    return LegGeometry(hip, -knee[2], -ankle[2], foot.ankle_height_m)


def _find_misfit(name: str, joint: Joint, above: str) -> str | None:
    """Return what is wrong with a joint of a leg that is carried by link ``above``; None if nothing is."""
    x, y, z = joint.origin_m
    if joint.parent != above:
        return f"parent must be link {above!r}, got {joint.parent!r}"
    if name in AXES and math.dist(joint.axis, AXES[name]) > AXIS_TOLERANCE:
        return f"axis must be {list(AXES[name])} (x forward, y left, z up, at zero angles), got {list(joint.axis)}"
    if name in CROSSING and math.hypot(x, y, z) > ORIGIN_TOLERANCE_M:
        return f"axis must cross that of the joint before it, origin_m [0, 0, 0]; got {[x, y, z]}"
    if name in BELOW and (math.hypot(x, y) > ORIGIN_TOLERANCE_M or not z < 0.0):
        return f"place must be straight below the joint before it, origin_m [0, 0, -length]; got {[x, y, z]}"
    return None


Arms = Literal["carried", "separate", "shared", "held"]

GRAVITY = 9.8  # [m/s^2], as in the paper, eq. (27)

# Section 4: the torso's origin is 0.25 to 0.31 m high. With NAO's ankles, hips and legs of 0.2029 m the distance of hip and ankle
# is then 0.5905 to 0.8862 leg lengths, which is taken for other robots, to the millimetre.
HEIGHT_SHARES = (0.5905, 0.8862)
# Angles of the arms at both ends of each phase [rad]: Table 3, rows 6 to 9, and Table 5, rows 4 to 7.
SWINGING = ("LShoulderPitch", "LElbowRoll", "RShoulderPitch", "RElbowRoll")
ARM_SWING: dict[Support, dict[str, tuple[float, float]]] = {
    Support.SINGLE: dict(zip(SWINGING, ((2.0, 1.0), (-0.42, -0.64), (1.0, 2.0), (0.64, 0.42)), strict=True)),
    Support.DOUBLE: dict(zip(SWINGING, ((1.0, 1.5), (-0.64, -0.50), (2.0, 1.5), (0.42, 0.50)), strict=True)),
}
# Of each joint, for each rad of the left shoulder's swing: in Table 3 the elbows' rolls swing by 0.22 rad for each rad of the
# shoulders. Rolls turn against each other in mirrored motions, so that opposite swings have equal factors.
PER_SHOULDER = {"LShoulderPitch": 1.0, "RShoulderPitch": -1.0, "LElbowRoll": 0.22, "RElbowRoll": 0.22}
LARGEST_SWING, LARGEST_RATE = 0.5, 1.0  # [rad], [rad/s]; Table 3 swings the shoulders by 0.5 rad to either side
ARM_COORDINATE = Coordinate(
    name="arm_swing",
    rate="arm_rate",
    bounds=(-LARGEST_SWING, LARGEST_SWING),
    largest_rate=LARGEST_RATE,
    mirror_sign=-1.0,
    words="left shoulder pitch above the middle, right one below it",
    rate_words="rate of the arms' swing",
)


def lock_unused_joints(loaded: Robot) -> Robot:
    """Return a robot of NAO's build with the joints locked at zero that no gait moves.

    NAO's head and neck become one with the torso; another robot may have fingers, or no neck. Raises InputError without the
    joints that the gait moves, or if the closed form does not solve its legs.
    """
    try:
        for joint in JOINTS:
            loaded.joint(joint)
    except UnknownNameError as error:
        raise InputError(f"robot {loaded.name!r} does not suit the NAO problems: {error}") from error
    welded = weld(loaded, [joint for joint in loaded.joints if joint not in JOINTS])
    for side in "LR":
        measure_leg(welded, side)
    return welded


def move_arms(swing: Mapping[str, tuple[float, float]], duration: SX, phase: SX) -> dict[str, Motion]:
    """Return the joint motions of both arms: those in ``swing`` as cubics from rest to rest [rad], the others held."""
    still = SX(0)
    moved = {name: cubic(SX(a), SX(b), still, still, duration, phase) for name, (a, b) in swing.items()}
    return {name: constant_motion(angle) for name, angle in HELD_ARM_ANGLES.items()} | moved


@dataclass(frozen=True, kw_only=True, eq=False)
class NaoBody(Body):
    """NAO, or a robot of its build: closed-form legs under an upright torso, arms that swing as in the paper."""

    arms: Arms = "carried"  # held: at rest in the middle of their swing

    def round_place(self, x: float) -> float:
        """Round to a micrometre, so that the paper's numbers come out exactly."""
        return round(x, 6)

    def angle_names(self, phase: Support) -> tuple[str, ...]:
        return tuple(ARM_SWING[phase])

    def angle_ends(self, phase: Support, point: InstantPoint) -> dict[str, tuple[SX, SX]]:
        swing = ARM_SWING[phase]
        if self.arms == "held":
            swing = {name: (sum(ends) / 2, sum(ends) / 2) for name, ends in swing.items()}
        return {name: (SX(start), SX(end)) for name, (start, end) in swing.items()}

    def cycle_angles(self, coordinates: Sequence[Motion]) -> Angles:
        """Return the joints of both arms, which swing against each other; elbows bend as their shoulders move."""
        (swing,) = coordinates
        middle = RESTING_ARM_ANGLES
        return {
            name: Motion(middle[name] + factor * swing.position, factor * swing.velocity, factor * swing.acceleration)
            for name, factor in PER_SHOULDER.items()
        }

    def plan(self, hip: Motion, angles: Angles, ankles: Mapping[str, Motion], margin: SX, ops: Nonsmooth) -> Instant:
        """Return the motion of the whole robot under an upright torso: closed-form legs between the hip and both ankles."""
        joints: dict[str, Motion] = {}
        knee_cosines = []
        for side, ankle in ankles.items():
            geometry = measure_leg(self.robot, side)
            (ankle_at, *rates), (hip_at, *hip_rates) = ankle, hip
            moving = (a - b for a, b in zip(rates, hip_rates, strict=True))
            hip_to_ankle = Motion(ankle_at - hip_at - DM(geometry.hip_m), *moving)
            leg = leg_angles(hip_to_ankle, geometry.thigh_m, geometry.tibia_m, margin, ops)
            rows = (Motion(*(order[i] for order in leg.joints)) for i in range(len(LEG_JOINTS)))
            joints |= {f"{side}HipYawPitch": constant_motion(0.0)}
            joints |= {f"{side}{name}": row for name, row in zip(LEG_JOINTS, rows, strict=True)}
            knee_cosines.append(leg.knee_cosine)
        joints |= {name: constant_motion(angle) for name, angle in RESTING_ARM_ANGLES.items()}
        places = {side: ankle.position for side, ankle in ankles.items()}
        return Instant(
            joints={**joints, **angles},
            hip=hip.position,
            ankles=places,
            knee_cosine=vertcat(*knee_cosines),
            arm_angle=vertcat(*(motion.position for motion in angles.values())),
        )

    def make_sole_margins(self, support_xy: tuple[float, float]) -> Margins:
        """Return the balance margins in x and y on the left sole.

        In x the distance to the sole's edge on the side of the ankle on which the ZMP lies: it jumps at the ankle, as printed.
        Outside the sole the paper's zero is continued below zero, so that an infeasible gait shows how far outside it is.

        Source:
            Gupta, Pratihar, Deb (2023), eqs. (21), (22); (B.6), (B.7) in docs/model.
        """
        foot = self.robot.feet["left"]

        def margins(zmp: MX, point: Point, ops: Nonsmooth) -> tuple[MX, MX]:
            x, y = zmp[0, :] - support_xy[0], zmp[1, :] - support_xy[1]
            dbm_x = ops.step(x, x + foot.back_m, foot.front_m - x)
            dbm_y = ops.min((foot.left_m - y).T, (y + foot.right_m).T).T
            return dbm_x, dbm_y

        return margins

    def check_footholds(self, footholds: Sequence[Foothold]) -> None:
        """Raise InputError if a foot turns."""
        if any(foothold.yaw for foothold in footholds):
            raise InputError(
                f"robot {self.full.name!r} does not turn: NAO has one motor for both hip yaw-pitch joints, so that no foot turns "
                "alone; turns are planned for legs whose hip joints turn one by one"
            )

    def make_curve_limits(self, phase: Support, count: int) -> tuple[Limit, ...]:
        """Return the limits of the arms' joints that swing."""
        return (ArmLimits(self.robot, tuple(ARM_SWING[phase])),) if count else ()


def make_nao(
    robot: str,
    *,
    rotational_inertia: bool = True,
    arms: Arms = "carried",
    zmp_gravity: ZmpGravity = "physical",
    zmp_masses: ZmpMasses = 25,
    limits: str | AddedLimits = "",
) -> NaoBody:
    """Return NAO, or a robot of its build by name or file, as its gaits take it; raises InputError for other robots.

    Arms are carried by the legs, or ``"separate"``: legs and torso are a chain without them, as the paper describes it;
    ``"held"`` are carried and do not swing. Without rotational inertia every link is a point mass.
    """
    full = load_robot(robot)
    simulated = lock_unused_joints(full)
    left, right = (measure_leg(simulated, side) for side in "LR")
    leg_length = left.thigh_m + left.tibia_m
    ground = left.ankle_height_m - left.hip_m[2]
    lowest, highest = (round(ground + share * leg_length, 3) for share in HEIGHT_SHARES)
    hips = (simulated.joint(name).child for name in YAW_PITCHES)
    separate = tuple(side + joint for side in "LR" for joint in ARM_JOINTS)
    return NaoBody(
        family="nao",
        title="NAO",
        full=full,
        simulated=simulated,
        robot=simulated if rotational_inertia else make_point_masses(simulated),
        joints=JOINTS,
        planned=PLANNED_JOINTS,
        mirrored=tuple(map(find_partner, JOINTS)),
        leg_joints={side: tuple(joint for joint in JOINTS if joint.startswith(side)) for side in "LR"},
        coordinates=(ARM_COORDINATE,),
        # Torso, soles, and hips whose yaw-pitch joint is held at zero keep the world's axes.
        upright=frozenset((simulated.root, *hips, *(foot.link for foot in simulated.feet.values()))),
        gravity=GRAVITY,
        feet_y=(left.hip_m[1], right.hip_m[1]),
        leg_length_m=leg_length,
        arms=arms,
        zmp_gravity=zmp_gravity,
        zmp_masses=zmp_masses,
        added_limits=parse_limits(limits),
        separate_joints=separate if arms in ("separate", "shared") else (),
        carries_shared_arms=arms == "shared",
        hip_height_m=(lowest, highest),
    )
