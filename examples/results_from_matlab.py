"""
Results from MATLAB in the report
=================================

Final points of any other program become records of a study: a CSV file with one row per run, the variables by name in any order.
Each point is judged like all others. From the command line: `nlp-gait import nao-dsp finals.csv --as "GA (MATLAB)"`.
"""

import csv
from pathlib import Path

from compare.analysis.columns import summarise
from compare.analysis.comparison import compare_problems
from compare.drawing.charts import make_final_gap_charts, plot_charts
from compare.study.import_runs import import_runs
from compare.study.run import ProblemSpec, Run
from compare.study.study import Study, run_study

spec = ProblemSpec(name="nao-dsp")

# %%
# A file as MATLAB's `writetable` writes it: here the two points that Gupta, Pratihar and Deb (2023) print for double support,
# with the power that they report for them (Table 8).

header = [*spec.load().names, "run", "objective", "evaluations"]
rows = [
    (0.31, -0.0008, -0.0055, 0.0520, 0.0010, -0.0367, -0.0424, 2.0, 0, 1.0682, 10000),
    (0.31, 0.0002, -0.0052, 0.0582, 0.0010, -0.0384, -0.0405, 2.0, 1, 1.0685, 10000),
]
with Path("finals.csv").open("w", newline="") as file:
    csv.writer(file).writerows([header, *rows])

# %%
# The records are compared with those of solvers that run here.

records = import_runs(spec, Path("finals.csv"), "paper (MATLAB)")
tasks = [Run(problem=spec, solver=algorithm, number=k) for algorithm in ("ipopt", "pso") for k in range(3)]
(comparison,) = compare_problems([*records, *run_study(Study(runs=tuple(tasks)))])
for row in summarise(comparison):
    claim = "no claim" if row["best_reported"] is None else f"claims {row['best_reported']:.4f} W"
    print(f"{row['solver']}: {row['feasible']} of {row['runs']} feasible, {claim}, judged {row['best']:.4f} W at best")

# %%
# The gap of every run at its end.

figure = plot_charts(make_final_gap_charts(comparison))
figure
