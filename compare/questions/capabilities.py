"""What a robot can do: its highest walking speed, longest step and highest lift of a foot, and the limits that stop it."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import ClassVar

from compare.analysis.units import choose_natural_step, join_words, with_unit
from compare.questions.question import Answer, Question, Work, make_record_table
from nlp_gait.backends.plan_walk import find_walk
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.formulation import Assembly, GaitProblem, Objective, Point
from nlp_gait.formulation.solution import ActiveConstraint, Solution
from nlp_gait.gaits.biped.body import TIMED_UNITS
from nlp_gait.gaits.humanoid.body import make_humanoid
from nlp_gait.gaits.humanoid.turning import find_sharpest_turn
from nlp_gait.symbolic.nonsmooth import Nonsmooth

FACTOR, MOST_ROUNDS = 2.0, 6  # by which our bounds are moved in each round, and the number of rounds
SHOWN = 4  # limits in a sentence
FREE = 1e-4  # share of the value: a limit whose natural step changes it by less does not stop the robot


@dataclass(frozen=True, kw_only=True)
class StoppingLimit:
    """A limit that stops the robot."""

    name: str  #: of the row or bound
    side: str  #: ``"lower"`` or ``"upper"``
    bound: float  #: [unit]
    unit: str
    gain: float  #: change of the quantity for a natural step of the limit, in its own unit
    ours: bool  #: whether it is one of our bounds rather than the robot's


@dataclass(frozen=True, kw_only=True)
class Round:
    """The greatest value with some of our bounds moved outwards."""

    value: float
    stops: tuple[StoppingLimit, ...]  #: most effective one first
    moved: Mapping[str, float]  #: parameters of our bounds, by name
    x: Mapping[str, float]  #: the gait, by variable name


@dataclass(frozen=True, kw_only=True)
class Capability:
    """How far one quantity goes."""

    words: str
    quantity: str  #: index or variable of a walking cycle
    unit: str
    rounds: tuple[Round, ...] = ()  #: the first one within all bounds; empty if no gait was found
    end: str = ""  #: why there are no more rounds

    @property
    def within(self) -> Round | None:
        """The round within all bounds."""
        return self.rounds[0] if self.rounds else None

    @property
    def beyond(self) -> Round | None:
        """With our bounds moved; None if they do not stop the robot."""
        return self.rounds[-1] if len(self.rounds) > 1 else None


GOALS = (
    Capability(words="highest speed", quantity="speed_m_s", unit="m/s"),
    Capability(words="longest step", quantity="step_length_m", unit="m"),
    Capability(words="highest lift of a foot", quantity="swing_height_m", unit="m"),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Capabilities(Question[tuple[Capability, ...]]):
    """What can this robot do, and what stops it?"""

    name: ClassVar[str] = "capabilities"
    counts: ClassVar[str] = "solves"

    starts: int = 3  #: random starts for the cheapest cycle, from which each quantity is raised
    seed: int = 0  #: of the starts

    def __post_init__(self) -> None:
        """Require a walking cycle whose step length is free."""
        missing = [goal.quantity for goal in GOALS[1:] if goal.quantity not in self.problem.names]
        if missing:
            raise InputError(
                f"{self.problem.name} has no variable {missing[0]!r}; use nao-cycle or humanoid-cycle with its default objective"
            )

    def find(self, work: Work) -> Iterator[tuple[Capability, ...]]:
        solver = work.solver()
        cheapest = solve(self.problem, starts=self.starts, seed=self.seed, solver=solver)
        work.progress("cheapest cycle")
        if not cheapest.feasible:
            raise InputError(
                f"{self.problem.name}: no feasible cycle was found from {self.starts} starts; {cheapest.status}"
            )
        capabilities: tuple[Capability, ...] = ()
        for goal in GOALS:
            capabilities += (raise_quantity(self.problem, goal, cheapest.x, solver, work),)
            yield capabilities

    def report(self, findings: tuple[Capability, ...]) -> Answer:
        stem = f"{self.problem.name}-capabilities"
        stops = [
            {"quantity": c.quantity, "round": k, "value": item.value, **asdict(stop)}
            for c in findings
            for k, item in enumerate(c.rounds)
            for stop in item.stops
        ]
        robot = self.problem.display.robot
        return Answer(
            stem=stem,
            title=f"What {robot.name if robot is not None else self.problem.name} can do",
            headline=(*(describe_capability(c) for c in findings), *describe_sharpest_turn(self.problem)),
            parts=[
                "Each value is the maximum of a walking cycle under all limits of the problem; limits are listed by what a "
                "natural step of each would gain. Bounds on times, velocities, step and lift are ours: NAO's in proportion, "
                "with least times and greatest velocities from the joints that swing the robot's legs. Where they stop the "
                f"robot, they are moved by a factor of {FACTOR:g}, again and again.",
                *(f"{c.words}: {c.end}." for c in findings),
                make_record_table(stem, stops),
            ],
            data={"problem": self.problem.name, "capabilities": [asdict(c) for c in findings]},
        )

    def failures(self, findings: tuple[Capability, ...]) -> list[str]:
        return [f"{c.words}: {c.end}" for c in findings if c.within is None]


def raise_quantity(
    problem: GaitProblem, goal: Capability, x: Mapping[str, float], solver: Solver, work: Work
) -> Capability:
    """Maximise a quantity from a feasible gait x; while our bounds stop it, move them outwards and continue."""
    raised = maximise(problem, goal)
    rounds: list[Round] = []
    moved: dict[str, float] = {}
    while len(rounds) < MOST_ROUNDS:
        solution = solve(raised, x0=x, solver=solver, workers=1)
        work.progress(f"{goal.words} {solution.objective:.4g} {goal.unit}")
        if not solution.converged:
            end = f"the next solve ends without a gait ({solution.status})"
            break
        x, stops = solution.x, list_stops(solution)
        rounds.append(Round(value=solution.objective, stops=stops, moved=dict(moved), x=x))
        change = dict(move_bound(stop) for stop in stops if stop.ours)
        if not change:
            end = "none of our bounds stops it"
            break
        moved |= change
        raised = raised.with_values(**change)
    else:
        end = f"our bounds still stop it after {MOST_ROUNDS} rounds"
    return replace(goal, rounds=tuple(rounds), end=end)


def maximise(problem: GaitProblem, goal: Capability) -> GaitProblem:
    """Return the problem that maximises a quantity under the same constraints."""

    def change(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
        index = assembly.indexes.get(goal.quantity)
        return replace(assembly, objective=point[goal.quantity] if index is None else index)

    objective = Objective(name=goal.quantity, unit=goal.unit, sense="maximise")
    return problem.derive(name=f"{problem.name}-{goal.quantity}", objective=objective, change=change)


def list_stops(solution: Solution) -> tuple[StoppingLimit, ...]:
    """Return the limits that stop a maximum, the one whose natural step gains most first."""
    stops = [
        StoppingLimit(
            name=limit.name,
            side=limit.side,
            bound=limit.bound,
            unit=limit.unit,
            gain=limit.price * choose_natural_step(limit.unit, limit.bound).size,
            ours=_is_ours(limit),
        )
        for limit in solution.active_constraints
    ]
    effective = (stop for stop in stops if abs(stop.gain) > FREE * abs(solution.objective))
    return tuple(sorted(effective, key=lambda stop: -abs(stop.gain)))


def _is_ours(limit: ActiveConstraint) -> bool:
    """Return whether a limit is a bound of ours on a time, a velocity or a goal; other bounds are clearances."""
    if not limit.name.startswith("bounds[") or limit.bound == 0.0:
        return False
    is_goal = any(limit.name == f"bounds[{goal.quantity}]" for goal in GOALS)
    return limit.unit in TIMED_UNITS or (is_goal and limit.side == "upper")


def move_bound(stop: StoppingLimit) -> tuple[str, float]:
    """Return the parameter of one of our bounds and its value further out; times stay positive."""
    variable = stop.name.removeprefix("bounds[").removesuffix("]")
    outwards = (stop.side == "upper") == (stop.bound > 0.0)
    wider = stop.bound * FACTOR if outwards else stop.bound / FACTOR
    return f"{variable}.{stop.side}", wider


def describe_sharpest_turn(problem: GaitProblem) -> list[str]:
    """Return the sharpest turn that footholds allow in a sentence; nothing for robots that do not turn."""
    robot = problem.options.get("robot")
    if not isinstance(robot, str) or find_walk(robot) == "nao-walk":
        return []
    turn = find_sharpest_turn(make_humanoid(robot))
    return [
        f"sharpest turn that joints and soles allow: {turn.turn_deg:g} degrees with each step of {turn.step_m:.3g} m; "
        f"if it is sharper, {turn.stopped_by}."
    ]


def describe_stops(end: Round) -> str:
    """Return the most effective limits in words, without the samples of their rows."""
    names = dict.fromkeys(f"{s.name.partition(',')[0].rstrip(']')}{']' * ('[' in s.name)}" for s in end.stops)
    return join_words(list(names)[:SHOWN]) or "no limit with a price"


def describe_capability(capability: Capability) -> str:
    """Return a capability in a sentence."""
    within, beyond, unit = capability.within, capability.beyond, capability.unit
    if within is None:
        return f"{capability.words}: {capability.end}"
    value = with_unit(within.value, unit, ".4g")
    sentence = f"{capability.words}: {value}, stopped by {describe_stops(within)}"
    if beyond is None:
        return f"{sentence}."
    ours = join_words(sorted({name.rpartition(".")[0] for name in beyond.moved}))
    further = f"{with_unit(beyond.value, unit, '.4g')}, stopped by {describe_stops(beyond)}"
    return f"{sentence}; bounds of ours among them. With wider ones ({ours}): {further}."
