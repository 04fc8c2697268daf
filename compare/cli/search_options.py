"""Options of commands that run search algorithms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import typer

from compare.cli.options import Evaluations, Seed
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import Handling, ProblemSpec, Stop
from nlp_gait.errors import InputError


@dataclass(frozen=True, kw_only=True)
class SearchOptions:
    """Number of runs of search algorithms, constraint handling, and stop criteria."""

    runs: Annotated[int, typer.Option(min=1, max=100_000, help="Runs of each search algorithm.")] = 11
    seed: Seed = 0
    evaluations: Evaluations = 10_000
    handling: Annotated[
        str, typer.Option(help="Constraints in searches: deb (feasibility rules), penalty or epsilon.")
    ] = "deb"
    penalty_weight: Annotated[
        float | None, typer.Option(help="Objective units per unit of violation, for --handling penalty.")
    ] = None
    target: Annotated[float | None, typer.Option(help="End a search at a feasible objective at least this good.")] = (
        None
    )
    stagnation: Annotated[
        int | None, typer.Option(min=1, help="End a search after this many generations without progress.")
    ] = None
    time_limit: Annotated[float | None, typer.Option(help="End a run after this many seconds.")] = None
    polish: Annotated[bool, typer.Option("--polish", help="IPOPT from each search's result, as another solver.")] = (
        False
    )

    def make_study(
        self, problems: Sequence[ProblemSpec], solvers: Sequence[SolverSpec], starts: int = 20
    ) -> StudySettings:
        """Return the study of problems by solvers, with a number of starts of gradient methods.

        Raises:
            InputError: a penalty without weight, or a weight without penalty.
        """
        if (self.handling == "penalty") != (self.penalty_weight is not None):
            raise InputError("--handling penalty and --penalty-weight go together; no weight suits every problem")
        weight = {} if self.penalty_weight is None else {"weight": self.penalty_weight}
        return StudySettings(
            problems=tuple(problems),
            solvers=tuple(solvers),
            runs=self.runs,
            starts=starts,
            handling=Handling(name=self.handling, settings=weight),
            stop=Stop(
                evaluations=self.evaluations,
                target=self.target,
                stagnation=self.stagnation,
                time_limit_s=self.time_limit,
            ),
            seed=self.seed,
        )
