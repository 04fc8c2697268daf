"""Your own search algorithm in 20 lines, in a study beside PSO and IPOPT."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from compare.analysis.comparison import compare_problems
from compare.analysis.table import HEADER, cells, summarise
from compare.report.document import Document, text_table
from compare.report.writing import markdown_page
from compare.study.study import Study, run_study
from compare.study.task import ProblemSpec, Task


@dataclass(frozen=True, kw_only=True)
class ShrinkingBox:
    """Samples uniformly around the best point so far, in a box that shrinks."""

    population: int = 50
    shrink: float = 0.97
    name: ClassVar[str] = "shrinking-box"

    def start(self, start):
        return ShrinkingBoxSearch(self, start)


class ShrinkingBoxSearch:
    def __init__(self, settings, start):
        self.settings, self.start, self.width = settings, start, 1.0
        self.X, self.best = start.initial, None

    def ask(self):
        return self.X

    def tell(self, X, f, violation, rule):
        i = rule.best(f, violation)
        if self.best is None or rule.better(f[i : i + 1], violation[i : i + 1], *self.best[1:])[0]:
            self.best = X[i], f[i : i + 1], violation[i : i + 1]
        self.width *= self.settings.shrink
        step = (self.start.rng.random(X.shape) - 0.5) * self.width * (self.start.upper - self.start.lower)
        self.X = np.clip(self.best[0] + step, self.start.lower, self.start.upper)

    def stop(self):
        return ()


problem = ProblemSpec(name="nao-ssp")
solvers = [(ShrinkingBox(), 5), (ShrinkingBox(shrink=0.98), 5), ("pso", 5), ("ipopt", 2)]
tasks = tuple(
    Task(
        problem=problem,
        algorithm=algorithm,
        run=run,
        label=f"box-{algorithm.shrink}" if hasattr(algorithm, "shrink") else "",
    )
    for algorithm, runs in solvers
    for run in range(runs)
)
(comparison,) = compare_problems(run_study(Study(tasks=tasks)))
table = text_table(HEADER, [cells(summary, comparison) for summary in summarise(comparison)])
print(markdown_page(Document(title="Shrinking boxes", parts=[table])))
