"""
Your own algorithm in the report
================================

Any object with ask and tell can take part in a study with PSO and IPOPT. It is judged like them and appears in the same tables
and figures. From the command line: `nlp-gait compare nao-ssp --algorithms pso,FILE.py:ShrinkingBox`.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from compare.analysis.columns import format_rows
from compare.analysis.comparison import compare_problems
from compare.drawing.charts import make_convergence_charts, plot_charts
from compare.report.document import Document, make_text_table
from compare.report.writing import render_markdown
from compare.study.run import ProblemSpec, Run
from compare.study.study import Study, run_study

# %%
# The settings of the algorithm start a search.


@dataclass(frozen=True, kw_only=True)
class ShrinkingBox:
    """Samples uniformly around the best point so far, in a box that shrinks."""

    population: int = 50
    shrink: float = 0.97
    name: ClassVar[str] = "shrinking-box"

    def start(self, start):
        return ShrinkingBoxSearch(self, start)


# %%
# The search proposes candidates when asked, and is told their objectives and violations.


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


# %%
# Five runs of each solver, judged by the same exact functions.

problem, runs = ProblemSpec(name="nao-ssp"), {"shrinking-box": ShrinkingBox(), "pso": "pso", "ipopt": "ipopt"}
tasks = [Run(problem=problem, solver=algorithm, number=k) for algorithm in runs.values() for k in range(5)]
(comparison,) = compare_problems(run_study(Study(runs=tuple(tasks))))
table = make_text_table(*format_rows(comparison))
print(render_markdown(Document(title="A shrinking box", parts=[table])))

# %%
# The best gap so far over evaluations and seconds.

figure = plot_charts(make_convergence_charts(comparison))
figure
