"""GaitBench as a package of OptunaHub: `Problem(id)` is an instance by its id, such as `ssp-v5` or `gb2:ssp:3`."""

from __future__ import annotations

from nlp_gait import gaitbench
from nlp_gait.gaitbench.adapters.optuna import OptunaProblem

__all__ = ["Problem"]


class Problem(OptunaProblem):
    """An instance of GaitBench."""

    available_problem_names = gaitbench.list_instances()

    def __init__(self, instance_id: str = "ssp-v5") -> None:
        super().__init__(gaitbench.load(instance_id))
