"""Walking of NAO: its cycle and its whole walk."""

from nlp_gait.formulation import GaitProblem, maker
from nlp_gait.gaits.biped.walking import CycleOptions, WalkOptions, plan_cycle, plan_walk
from nlp_gait.gaits.nao.problems import NaoMotorOptions


@maker
def nao_cycle(robot: NaoMotorOptions, options: CycleOptions) -> GaitProblem:
    """Walking cycle of NAO: one step, whose mirror image is the next one.

    The published phases cannot be chained: single support ends with the hip 0.03 m ahead of the stance foot, double support
    starts 0.01 m ahead of it, and arms and velocities differ too. Here the states at both switches, the times and the step
    length are variables, and the cycle repeats after mirroring left to right.

    By ``torso_share="lever"`` the load passes from foot to foot.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walking cycle by this package.
    """
    return plan_cycle(robot.make_body(), options)


@maker
def nao_walk(robot: NaoMotorOptions, options: WalkOptions) -> GaitProblem:
    """Whole walk of NAO from standing to standing: weight shift, half step, steps, half step, weight shift.

    Angles of its footholds are 0: one motor turns both feet.

    Source:
        Phases of Gupta, Pratihar, Deb (2023), sections 3 and 4; joined to a walk by this package.
    """
    return plan_walk(robot.make_body(), options)
