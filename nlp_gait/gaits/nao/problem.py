"""What every problem of one NAO phase is made of: its parts, its goal, and the problem around them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from nlp_gait.formulation import GaitProblem, SimulationModel, Start
from nlp_gait.gaits.biped.goals import HEAT_LOSS
from nlp_gait.gaits.biped.parts import BalanceMargins, JointLimits, Margins, Part, Reach, TorqueChange
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.problem import problem_of
from nlp_gait.gaits.nao.body import GRAVITY, PLANNED_JOINTS, nao
from nlp_gait.gaits.nao.skeleton import skeleton
from nlp_gait.robots import Robot, load_robot


def paper_parts(robot: Robot, margins: Margins, mean_limits_m: tuple[float, float]) -> tuple[Part, ...]:
    """Limits of both published phases (Gupta, Pratihar, Deb 2023, sections 4.1 and 4.2)."""
    return (JointLimits(robot, PLANNED_JOINTS), Reach(), TorqueChange(), BalanceMargins(margins, mean_limits_m))


def phase_problem(
    name: str,
    title: str,
    phase: Phase,
    robot: str,
    *,
    start: Start | None = None,
    searchable: bool = True,
) -> GaitProblem:
    """Problem of one phase of NAO; ``robot`` is its name or file, the others are those of ``problem_of``."""
    problem = problem_of(name, title, phase, start=start, searchable=searchable)
    return with_robot(replace(problem, rows_over_time=phase.rows_over_time()), robot, phase.robot.armatures_kgm2)


def with_robot(
    problem: GaitProblem, robot: str, armatures_kgm2: Mapping[str, float], *, repeats: bool = False
) -> GaitProblem:
    """The problem with what drawing and playing its gaits need of a robot.

    Args:
        problem: without.
        robot: name or file, with all its joints.
        armatures_kgm2: by joint, the inertia of rotors that the gait was planned with: it is played with the same.
        repeats: a gait is one step, whose mirror image is the next one.
    """
    full = load_robot(robot)
    played = replace(nao(robot, rotational_inertia=True), armatures_kgm2=armatures_kgm2)
    simulation_model = SimulationModel(robot=played, gravity=GRAVITY, heat_loss=HEAT_LOSS.name, repeats=repeats)
    display = replace(problem.display, robot=full, skeleton=skeleton(full), simulation_model=simulation_model)
    return replace(problem, display=display)
