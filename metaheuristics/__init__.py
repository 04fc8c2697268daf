"""Metaheuristics for bounded, constrained minimisation of objectives that are evaluated in batches.

Independent of any problem and of CasADi: an objective is anything that follows `BatchObjective`.

    result = minimize(objective, ParticleSwarm(population=50), evaluations=10_000, seed=1)
    result = minimize(objective, make_algorithm("ga", survival="generational"), handling=StaticPenalty(weight=2.0))
"""

from metaheuristics.algorithms.ant_colony import AntColony, AntColonyGrid
from metaheuristics.algorithms.genetic import Flip, GeneticAlgorithm, Polynomial, SimulatedBinary, SinglePoint
from metaheuristics.algorithms.particle_swarm import ParticleSwarm
from metaheuristics.algorithms.random_search import RandomSearch
from metaheuristics.errors import SearchError
from metaheuristics.interface import (
    Algorithm,
    BatchObjective,
    ConstraintHandling,
    Deb,
    History,
    Interrupted,
    Result,
    Rule,
    Search,
    Start,
    StaticPenalty,
)
from metaheuristics.minimize import minimize
from metaheuristics.preparation import check_budget
from metaheuristics.registry import (
    ADAPTERS,
    ALGORITHMS,
    list_installed_algorithms,
    make_algorithm,
    make_handling,
)
from metaheuristics.user_algorithm import PlainFunction, to_algorithm

__all__ = [
    "ADAPTERS",
    "ALGORITHMS",
    "Algorithm",
    "AntColony",
    "AntColonyGrid",
    "BatchObjective",
    "ConstraintHandling",
    "Deb",
    "Flip",
    "GeneticAlgorithm",
    "History",
    "Interrupted",
    "ParticleSwarm",
    "PlainFunction",
    "Polynomial",
    "RandomSearch",
    "Result",
    "Rule",
    "Search",
    "SearchError",
    "SimulatedBinary",
    "SinglePoint",
    "Start",
    "StaticPenalty",
    "check_budget",
    "list_installed_algorithms",
    "make_algorithm",
    "make_handling",
    "minimize",
    "to_algorithm",
]
