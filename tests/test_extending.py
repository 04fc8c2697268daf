"""A limit and a joint between phases, added as under "To add a ..." in docs/developing.md: each is one class."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest

import nlp_gait
from nlp_gait.formulation import (
    Constraint,
    Grid,
    InstantPoint,
    Parameter,
    Point,
    Variable,
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
from nlp_gait.symbolic.nonsmooth import Nonsmooth


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
