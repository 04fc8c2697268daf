"""A problem with another robot under the same limits: real masses, leg lengths and soles are never quite those of the data."""

from __future__ import annotations

from collections.abc import Mapping

from compare.study.task import ProblemSpec
from nlp_gait.formulation import GaitProblem
from nlp_gait.robots.perturbation import MASS, perturbed_name, split_name


def is_mass(quantity: str) -> bool:
    """True for a factor of masses, False for a length that is added [m]."""
    return quantity.endswith(MASS)


def present_value(problem: GaitProblem, quantity: str) -> float:
    """Value of a quantity in the problem's own robot; see ``nlp_gait.robots.perturbation``."""
    _, changes = split_name(str(problem.options["robot"]))
    return changes.get(quantity, float(is_mass(quantity)))


def robot_name(problem: GaitProblem, values: Mapping[str, float]) -> str:
    """Name of the problem's robot with other values of some quantities."""
    name, changes = split_name(str(problem.options["robot"]))
    return perturbed_name(name, {**changes, **values})


def with_robot(spec: ProblemSpec, values: Mapping[str, float]) -> GaitProblem:
    """The problem with other values of its robot's quantities; an error in a robot's data does not move the limits."""
    problem = spec.load()
    other = spec.with_options(robot=robot_name(problem, values)).load()
    return other.with_values(**problem.parameter_values)
