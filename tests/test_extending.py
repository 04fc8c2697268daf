"""The extensions under "To add a ..." in docs/developing.md: each takes one new file and at most two lines elsewhere."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import casadi as ca
import numpy as np
import pytest
import typer
from casadi import DM, MX
from typer.testing import CliRunner

import metaheuristics
import nlp_gait
from compare.cli import app
from compare.judge import evaluate
from compare.study.run import ProblemSpec, Run, Stop
from compare.study.study import Study, run_study
from metaheuristics import registry as algorithms
from metaheuristics.interface import Array, Start
from nlp_gait.formulation import (
    Assembly,
    Constraint,
    Display,
    GaitProblem,
    Grid,
    InstantPoint,
    NumericPoint,
    Objective,
    Parameter,
    Point,
    Signals,
    Variable,
    maker,
)
from nlp_gait.gaits.biped.body import Body, Support
from nlp_gait.gaits.biped.cycle import make_cycle_problem, make_walking_cycle
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.limits import Limit, RowsAndIndexes
from nlp_gait.gaits.biped.loads import make_divided_loads
from nlp_gait.gaits.biped.phase_problem import make_phase_problem
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.gaits.biped.support_phases import make_support_phase
from nlp_gait.gaits.biped.switch import Switch, SwitchState
from nlp_gait.gaits.humanoid.body import make_humanoid
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.providers import PROBLEMS
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.robots.custom import humanoid

X = "0.33,-0.002,0.0034,0.008,0.0025,0.0243,-0.0256,0.015,4"
LIFT, TIME = "lift_m", "step_time_s"


@maker
def hopping_foot(*, intervals: int = 20) -> GaitProblem:
    """A mass of 1 kg that is moved 0.2 m along and lifted by a chosen height on the way: least mean |force times speed|."""
    phases = DM(np.linspace(0.0, 1.0, intervals + 1)).T

    def moved(at: Point) -> tuple[MX, MX, MX]:
        """Height, power along and power upwards."""
        time, lift = at[TIME], at[LIFT]
        speed, force = 0.2 * 6 * phases * (1 - phases) / time, 0.2 * (6 - 12 * phases) / time**2
        height = 16 * lift * phases**2 * (1 - phases) ** 2
        climb = 32 * lift * phases * (1 - phases) * (1 - 2 * phases) / time
        return height, force * speed, 9.81 * climb

    def assemble(at: Point, ops: Nonsmooth) -> Assembly:
        height, along, upwards = moved(at)
        power = ca.sum1(ops.abs((along + upwards).T)) / (intervals + 1)
        clear = Constraint(
            name="clearance", unit="m", scale=0.01, value=height[intervals // 2], lower=at["least_clearance_m"]
        )
        return Assembly(objective=power, constraints=(clear,), indexes={"power_W": power})

    def motion(at: NumericPoint) -> Signals:
        height = ca.evalf(moved(at)[0]).full().T
        return Signals(joints=("foot",), arrays={"t": float(at[TIME]) * phases.full()[0], "q": height}, columns={})

    return GaitProblem(
        name="hopping-foot",
        title="A foot that hops",
        variables=(
            Variable(name=LIFT, unit="m", lower=0.0, upper=0.1, description="height halfway"),
            Variable(name=TIME, unit="s", lower=0.2, upper=2.0, description="of the step"),
        ),
        own_parameters=(
            Parameter(name="least_clearance_m", unit="m", default=0.03, description="least height halfway"),
        ),
        objective=Objective(name="power", unit="W"),
        assemble=assemble,
        grid=Grid(intervals=intervals, refined_by="intervals"),
        display=Display(motion=motion),
    )


def test_a_problem_is_one_function_and_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Solved, searched, judged on a dense grid, and part of a study, by its name."""
    monkeypatch.setitem(PROBLEMS, "hopping-foot", f"{__name__}:hopping_foot")
    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
    problem = nlp_gait.load("hopping-foot", intervals=10)
    assert problem.options == {"intervals": 10}
    solution = nlp_gait.solve(problem, starts=2)
    assert (
        solution.converged
        and solution.x[LIFT] == pytest.approx(0.03, abs=1e-6)
        and solution.x[TIME] == pytest.approx(2.0)
    )
    verdict = evaluate(problem, problem.check_x(solution.x))
    assert verdict.feasible and verdict.dense_intervals == 1000
    assert problem.signals(solution.x).arrays["q"].max() == pytest.approx(0.03, abs=1e-6)
    spec = ProblemSpec(name="hopping-foot", options={"intervals": 10})
    records = run_study(Study(runs=(Run(problem=spec, solver="pso", stop=Stop(evaluations=2000)),)))
    assert records[0].objective == pytest.approx(solution.objective, rel=1e-3)
    done = CliRunner().invoke(app, ["solve", "hopping-foot", "--starts", "1"])
    assert done.exit_code == 0 and "power" in done.output


class MostHipSpeed(Limit):
    """The hip must not be faster than a limit."""

    parameters = (
        Parameter(name="hip_rate_limit_rad_s", unit="rad/s", default=10.0, description="largest rate of a hip's pitch"),
    )

    def add(self, at: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        limit = at["hip_rate_limit_rad_s"]
        rates = samples.qd[samples.moving.index("LHipPitch"), :].T
        labels = tuple(str(k) for k in range(samples.steps + 1))
        row = Constraint(
            name="hip_rate", labels=labels, unit="rad/s", scale=1.0, value=rates, lower=-limit, upper=limit
        )
        return [row], {}


@pytest.mark.slow
def test_a_limit_of_a_gait_is_one_class() -> None:
    """It is added to those of single support, limits the motion there, and has a parameter."""
    body, grid = make_nao("nao-v5"), Grid(intervals=4)
    paper = make_support_phase(body, Support.SINGLE, 0.06, "cubic", grid, Goal())
    phase = replace(paper, limits=(*paper.limits, MostHipSpeed()))
    problem = make_phase_problem("ssp", "single support with a limit on a hip's speed", phase)
    solution = nlp_gait.solve(problem)
    fastest = np.abs(problem.signals(solution.x).arrays["qd"]).max(axis=0)
    own = float(fastest[problem.signals(solution.x).joints.index("LHipPitch")])
    slower = nlp_gait.solve(problem.with_values(hip_rate_limit_rad_s=0.9 * own))
    assert slower.converged and slower.objective > solution.objective
    assert any(bound.name.startswith("hip_rate[") for bound in slower.active_constraints)


@dataclass(frozen=True, kw_only=True)
class Push(Switch):
    """A touch-down at which the hip gains a forward velocity, a variable."""

    def make_variables(self, body: Body) -> list[Variable]:
        return [Variable(name="push_m_s", unit="m/s", lower=0.0, upper=0.1, description="gained at touch-down")]

    def change_state(self, body: Body, point: InstantPoint, before: SwitchState) -> SwitchState:
        return before._replace(hip_velocity=before.hip_velocity + ca.vertcat(point["push_m_s"], 0, 0))


@pytest.mark.parametrize("make", [make_nao, make_humanoid])
def test_a_joint_between_phases_is_one_class(make: Callable[[str], Body]) -> None:
    """The cycles of both families have its variables and its laws."""
    body, grid = make("nao-v5"), Grid(intervals=2)
    loads, push = make_divided_loads(body, "lever"), Push(name="touch_down")
    cycle = make_walking_cycle(body, loads, grid, Goal(), at_given_speed=False, touch_down=push)
    problem = make_cycle_problem(cycle)
    x = problem.start_point(np.random.default_rng(0))
    x[problem.variable_index("push_m_s")] = 0.05
    single, double = (phase.signals(problem.at(x)).arrays["qd"] for phase in cycle.phases.values())
    assert np.abs(double[0] - single[-1]).max() > 0.1


@dataclass(frozen=True, kw_only=True)
class RandomPoints:
    """Random search."""

    population: int = 50
    name: ClassVar[str] = "random-points"

    def start(self, start: Start) -> RandomSearch:
        return RandomSearch(start, self.population)


class RandomSearch:
    def __init__(self, start: Start, population: int) -> None:
        self._start, self._next, self._population = start, start.initial, population

    def ask(self) -> Array:
        return self._next

    def tell(self, X: Array, f: Array, violation: Array, rule: metaheuristics.Rule) -> None:
        lower, upper = self._start.lower, self._start.upper
        self._next = self._start.rng.uniform(lower, upper, (self._population, len(lower)))

    def stop(self) -> tuple[str, ...]:
        return ()


def test_a_search_algorithm_is_one_file_and_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(algorithms, "ALGORITHMS", {**algorithms.ALGORITHMS, "random-points": RandomPoints})
    made = metaheuristics.make_algorithm("random-points", population=20)
    result = metaheuristics.minimize(nlp_gait.compile_objective(nlp_gait.load("walk12")), made, evaluations=400)
    assert result.evaluations == 400 and made == RandomPoints(population=20)


def test_a_robot_is_one_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.json"
    file.write_text(json.dumps(humanoid()))
    done = CliRunner().invoke(app, ["evaluate", "nao-ssp", "--robot", str(file), "--x", X])
    assert done.exit_code == 0 and nlp_gait.load("nao-ssp", robot=str(file)).display.robot is not None


def test_a_question_is_one_folder_and_one_line() -> None:
    """A command beside the others, with their options."""
    own = typer.Typer()
    own.registered_commands = list(app.registered_commands)

    @own.command("heaviest-bound")
    def heaviest_bound(problem: str) -> None:
        """Which bound costs most?"""
        solution = nlp_gait.solve(nlp_gait.load(problem), starts=2)
        typer.echo(solution.active_constraints[0].name)

    done = CliRunner().invoke(own, ["heaviest-bound", "walk12"])
    assert done.exit_code == 0 and done.output.strip() == "bounds[step_length_m]"


@pytest.mark.slow
def test_mathematics_is_changed_by_derive() -> None:
    """The example of the guide: a price on time, as an added parameter."""
    price = Parameter(name="price_W_s", unit="W/s", default=1.0, description="of a second", minimum=0.0)
    problem = nlp_gait.load("nao-ssp", intervals=4).derive(
        name="in-a-hurry",
        parameters=(price,),
        change=lambda gait, at, ops: replace(
            gait, objective=gait.objective + at["price_W_s"] * at["single_support_time_s"]
        ),
    )
    hurried = nlp_gait.solve(problem)
    assert hurried.converged and hurried.x["single_support_time_s"] < 2.0
    assert problem.signals(hurried.x).arrays["t"][-1] == pytest.approx(hurried.x["single_support_time_s"])
