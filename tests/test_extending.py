"""A limit, added as under "To add a ..." in docs/developing.md: it is one class."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import nlp_gait
from nlp_gait.formulation import (
    Constraint,
    Grid,
    Parameter,
    Point,
)
from nlp_gait.gaits.biped.body import Support
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.limits import Limit, RowsAndIndexes
from nlp_gait.gaits.biped.phase_problem import make_phase_problem
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.gaits.biped.support_phases import make_support_phase
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
