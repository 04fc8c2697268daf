"""One foot on the ground: loads of the whole robot on it, the path of the other foot, and the mean margins asked for."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from casadi import SX

from nlp_gait.gaits.biped.instant import Loader, Loads
from nlp_gait.robots import Foot, Robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.balance import below, zmp_of_wrench
from nlp_gait.symbolic.dynamics import newton_euler
from nlp_gait.symbolic.trajectories import Motion, constant_motion, cubic, parabola_lift, stack

# Section 4.1: least mean margins of 0.05 m and 0.02 m, on NAO's sole of 0.15 m by 0.08 m.
MEAN_DBM_SHARES = (1 / 3, 1 / 4)


def single_support_mean_margins(foot: Foot) -> tuple[float, float]:
    """Least mean balance margins in x and y as shares of the sole, to a tenth of a millimetre [m]."""
    along, across = MEAN_DBM_SHARES
    return round(along * (foot.back_m + foot.front_m), 4), round(across * (foot.left_m + foot.right_m), 4)


def swing_foot(start_x: SX, end_x: SX, y: float, ankle_height: float, lift: SX, duration: SX, phase: SX) -> Motion:
    """Motion of a swinging foot's ankle (3,) from rest to rest over a parabola [m] (Table 3, rows 1 and 2)."""
    forward = cubic(start_x, end_x, SX(0), SX(0), duration, phase)
    rise = parabola_lift(forward, start_x, end_x, lift)
    return stack(forward, constant_motion(y), rise._replace(position=rise.position + ankle_height))


def loads_on_left(robot: Robot, gravity: float, upright: Collection[str]) -> Loader:
    """Torques of the whole tree from the left foot, which supports it, and the ZMP from the ground's wrench on that foot.

    Args:
        robot: with links welded that never move.
        gravity: [m/s^2].
        upright: links that never turn.
    """
    foot = robot.feet["left"]
    tree = tree_from(robot, foot.link)

    def loads(joints: Mapping[str, Motion], hip: SX, feet: Mapping[str, SX], _: SX) -> Loads:
        q, qd, qdd = ({name: motion[order] for name, motion in joints.items()} for order in range(3))
        torques, wrench = newton_euler(tree, q, qd, qdd, gravity, upright=upright)
        offset = zmp_of_wrench(wrench, foot.ankle_height_m, robot.mass_kg * gravity)
        return Loads(torques, feet["L"] + offset, {"L": below(wrench, foot.ankle_height_m), "R": SX(6, 1)})

    return loads
