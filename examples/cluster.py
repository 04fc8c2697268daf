"""
A study on a cluster
====================

The runs of a study are distributed to the workers of a Dask scheduler; records come back as each run ends, and an interrupted
study continues. Here two workers on this machine replace a cluster. Needs the extra `cluster`. From the command line:
`nlp-gait compare nao-ssp --scheduler tcp://HOST:8786 --out study`.
"""
# sphinx_gallery_thumbnail_path = "images/budgets.png"

from pathlib import Path

from distributed import LocalCluster

from compare.analysis.columns import summarise
from compare.analysis.comparison import compare_problems
from compare.drawing.charts import make_final_gap_charts, plot_charts
from compare.study.run import ProblemSpec, Run
from compare.study.study import Study, run_study

tasks = [
    Run(problem=ProblemSpec(name="nao-dsp"), solver=algorithm, number=run)
    for algorithm in ("ipopt", "pso", "ga")
    for run in range(4)
]

# %%
# Workers import this file, so only the main process starts a cluster and runs the study.

if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        study = Study(runs=tuple(tasks), folder=Path("study"), scheduler=cluster.scheduler_address)
        records = run_study(study, progress=print)

# %%
# The records are those of a study on one machine.

if __name__ == "__main__":
    (comparison,) = compare_problems(records)
    for row in summarise(comparison):
        print(f"{row['solver']}: {row['feasible']} of {row['runs']} feasible, median {row['median']:.6f} W")

# %%
# The gap of every run at its end.

figure = plot_charts(make_final_gap_charts(comparison)) if __name__ == "__main__" else None
figure
