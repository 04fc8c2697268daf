"""A problem with a perturbed robot: masses, leg lengths and soles are never exactly those of the data."""

from collections.abc import Mapping

from compare.study.run import ProblemSpec
from nlp_gait.formulation import GaitProblem
from nlp_gait.robots.perturbation import MASS, name_perturbed, split_name


def is_mass(quantity: str) -> bool:
    """Return True for a factor of masses, False for a length that is added [m]."""
    return quantity.endswith(MASS)


def get_quantity(problem: GaitProblem, quantity: str) -> float:
    """Return the value of a quantity of the problem's robot; see ``nlp_gait.robots.perturbation``."""
    _, changes = split_name(str(problem.options["robot"]))
    return changes.get(quantity, float(is_mass(quantity)))


def perturb_robot(problem: GaitProblem, values: Mapping[str, float]) -> GaitProblem:
    """Return the problem with other values of its robot's quantities; errors in a robot's data do not move the limits."""
    name, changes = split_name(str(problem.options["robot"]))
    robot = name_perturbed(name, {**changes, **values})
    spec = ProblemSpec(name=problem.address, options={**problem.options, "robot": robot}, values=problem.values)
    return spec.load().with_values(**problem.parameter_values)
