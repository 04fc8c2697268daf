"""
Your own paper
==============

A reproduction is two files: ``your_own_paper.csv`` has a row for each claim, here three of a made-up paper on the walker of
``your_own_problem.py``, and this one computes their numbers. ``nlp-gait reproduce FILE.py --out DIR`` writes the report.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from your_own_problem import walker

from compare.analysis.record_statistics import approximate_rank_sum
from compare.papers.paper import Paper
from compare.papers.paper_runs import Effort, Runner, choose_best, evaluate_point, make_search_tasks, make_start_tasks
from compare.papers.rules import Found
from compare.report.document import Figure
from compare.study.run import ProblemSpec
from metaheuristics import GeneticAlgorithm, ParticleSwarm

PRINTED_X = (0.18, 0.13, -0.27, 0.006, 0.57)
WALKER = walker()
SPEEDS_M_S = (0.4, 0.5, 0.6)
SEARCHES = {"pso": ParticleSwarm(), "ga": GeneticAlgorithm()}

# %%
# Results of one reading, and how they are computed: optima over the speed, and runs of two searches unless the run is quick.


@dataclass
class Results:
    spec: ProblemSpec
    runs: dict


def make_spec(speed):
    return ProblemSpec(name=WALKER, values={"speed_m_s": speed}, label=f"walker-{speed:g}")


def compute(runner, effort):
    specs = [make_spec(speed) for speed in SPEEDS_M_S]
    tasks = [task for spec in specs for task in make_start_tasks(spec, 2)]
    tasks += make_search_tasks(specs[1], SEARCHES, effort.runs, 2000)
    return {"as printed": Results(specs[1], runner.run_tasks(tasks))}


def list_powers(found):
    return [choose_best(found.runs[f"walker-{speed:g}", "ipopt"]).objective for speed in SPEEDS_M_S]


def compare_searches(found):
    pso, ga = ([run.objective for run in found.runs[found.spec.title, search]] for search in SEARCHES)
    return Found(np.median(ga) - np.median(pso), p=approximate_rank_sum(pso, ga))


# %%
# What the page shows beside the claims, and a function for each id of the table.


def show(results):
    figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
    axes.plot(SPEEDS_M_S, list_powers(results["as printed"]), "o-")
    axes.set(xlabel="speed [m/s]", ylabel="least power [W]")
    return [Figure(name="speeds", caption="Least power over the speed", drawing=figure)]


REPRODUCTION = Paper(
    module=__file__, title="A made-up paper", full=Effort(runs=11), quick=Effort(), readings={"as printed": "as printed"},
    compute=compute, headlines=("power", "faster", "better"), show=show, numbers_of_runs={"better": compare_searches},
    numbers={"power": lambda found: evaluate_point(found.spec, PRINTED_X)["power"], "faster": list_powers})  # fmt: skip

# %%
# The same as the command, without the searches.

if __name__ == "__main__":
    runner = Runner(folder=Path(tempfile.mkdtemp()), progress=print, jobs=1)
    record = REPRODUCTION.reproduce(runner, REPRODUCTION.quick)
    print(*record["sentences"], sep="\n")
    figure = plt.gcf()
