"""What competes with power: a mean balance margin or the walking speed, each with a least value that can be demanded."""

from dataclasses import dataclass, replace

from casadi import MX

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import CompiledObjective
from nlp_gait.errors import InputError, unknown
from nlp_gait.formulation import Array, Assembly, GaitProblem, Objective, Parameter, Point
from nlp_gait.formulation.solution import Solution
from nlp_gait.symbolic.nonsmooth import Nonsmooth

SPEED = "speed"
MARGINS = ("dbm_y_mean", "dbm_x_mean")
REWARD = "reward_W_per_unit"


@dataclass(frozen=True, kw_only=True)
class Margin:
    """A dynamic balance margin's mean over the samples, along x or across y."""

    name: str
    unit: str = "m"

    def drop_demand(self, problem: GaitProblem) -> GaitProblem:
        """Return the problem with the least demand: zero, which keeps the ZMP within the soles' box."""
        return self.demand(problem, 0.0)

    def demand(self, problem: GaitProblem, least: float) -> GaitProblem:
        """Return the problem with a least value."""
        return problem.with_values(**{f"{self.name}_limit_m": least})

    def evaluate(self, problem: GaitProblem, x: Array) -> float:
        """Return the exact value at x (n,)."""
        return build_exact_model(problem).at(x, problem.p).indexes[f"{self.name}_m"]

    def evaluate_many(self, objective: CompiledObjective, X: Array) -> Array:
        """Return the values (P,) of candidates (P, n)."""
        values: Array = objective.constraints(X)[:, objective.groups.index(self.name)]
        return values

    def express(self, point: Point, assembly: Assembly) -> MX:
        """Return a scalar for the assembly of a problem."""
        return assembly.group(self.name).value

    def compute_price(self, solution: Solution) -> float:
        """Return the change of the least power per unit of the demand [W/unit]."""
        return sum((a.price for a in solution.active_constraints if a.name.partition("[")[0] == self.name), 0.0)


@dataclass(frozen=True, kw_only=True)
class Speed:
    """Mean speed of the hip over the phase, with the methods of ``Margin``: its prescribed distance by its duration."""

    duration: str  #: variable that holds the phase's duration
    distance_m: float  #: of the hip along x
    name: str = SPEED
    unit: str = "m/s"

    def drop_demand(self, problem: GaitProblem) -> GaitProblem:
        return problem  # its bound on the duration demands no more speed than that

    def demand(self, problem: GaitProblem, least: float) -> GaitProblem:
        longest = max(problem.value(f"{self.duration}.lower"), self.distance_m / least)
        return problem.with_values(**{f"{self.duration}.upper": longest})

    def evaluate(self, problem: GaitProblem, x: Array) -> float:
        return self.distance_m / float(x[problem.variable_index(self.duration)])

    def evaluate_many(self, objective: CompiledObjective, X: Array) -> Array:
        return self.distance_m / X[:, objective.names.index(self.duration)]

    def express(self, point: Point, assembly: Assembly) -> MX:
        return self.distance_m / point[self.duration]

    def compute_price(self, solution: Solution) -> float:
        # dP/dv = dP/dT dT/dv with T = distance / v
        bound = f"bounds[{self.duration}]"
        per_second = sum(a.price for a in solution.active_constraints if a.name == bound and a.side == "upper")
        return -per_second * solution.x[self.duration] ** 2 / self.distance_m


CompetingObjective = Margin | Speed
"""A quantity to be maximised, whose least value can be demanded by a parameter."""


def make_competing_objective(name: str, problem: GaitProblem) -> CompetingObjective:
    """Return the objective of this name that a NAO phase trades against power.

    Raises:
        UnknownNameError: an unknown objective.
        InputError: the problem has no power, margins and duration to trade.
    """
    durations = problem.display.durations
    if problem.objective.name != "power" or len(durations) != 1 or problem.display.motion is None:
        raise InputError(f"{problem.name} has no power, balance and speed to trade; allowed are nao-ssp and nao-dsp")
    if name in MARGINS:
        return Margin(name=name)
    if name != SPEED:
        raise unknown("objective next to power", name, (*MARGINS, SPEED))
    middle = (problem.lower + problem.upper) / 2
    hip = problem.signals(middle).arrays["hip"]
    return Speed(duration=durations[0], distance_m=round(float(hip[-1, 0] - hip[0, 0]), 9))


def add_reward(problem: GaitProblem, criterion: CompetingObjective, reward: float) -> GaitProblem:
    """Return the problem that minimises power less a reward for the criterion [W per unit]."""

    def change(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
        cost = assembly.objective - point[REWARD] * criterion.express(point, assembly)
        return replace(assembly, objective=cost)

    parameter = Parameter(
        name=REWARD, unit=f"W/({criterion.unit})", default=0.0, description=f"reward for {criterion.name}", minimum=0.0
    )
    return problem.derive(
        name=f"{problem.name}-{criterion.name}",
        objective=Objective(name="rewarded_power", unit="W"),
        parameters=(parameter,),
        change=change,
    ).with_values(**{REWARD: reward})
