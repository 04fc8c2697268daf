"""Options that `search` and `compare` share: how constraints are handled, when runs end, where they run."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.study.task import Handling, Stop
from nlp_gait.errors import InputError

Handle = Annotated[
    str, typer.Option("--handling", help="Constraints in searches: deb (feasibility rules), penalty or epsilon.")
]
PenaltyWeight = Annotated[
    float | None, typer.Option(help="Objective units per unit of violation, for --handling penalty.")
]
Target = Annotated[float | None, typer.Option(help="End a search at a feasible objective at least this good.")]
Stagnation = Annotated[int | None, typer.Option(min=1, help="End a search after so many generations without progress.")]
TimeLimit = Annotated[float | None, typer.Option("--time-limit", help="End a run after so many seconds.")]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Run on the workers of this Dask scheduler instead.")
]


def handling_of(name: str, penalty_weight: float | None) -> Handling:
    """Constraint handling of a command line.

    Raises:
        InputError: a penalty without weight, or a weight without penalty.
    """
    if (name == "penalty") != (penalty_weight is not None):
        raise InputError("--handling penalty and --penalty-weight go together; no weight suits every problem")
    return Handling(name=name, settings={} if penalty_weight is None else {"weight": penalty_weight})


def stop_of(evaluations: int, target: float | None, stagnation: int | None, time_limit: float | None) -> Stop:
    """Stopping criteria of a command line."""
    return Stop(evaluations=evaluations, target=target, stagnation=stagnation, time_limit_s=time_limit)
