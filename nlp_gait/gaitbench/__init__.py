"""GaitBench: constrained problems that cost microseconds and whose optimum is known, frozen (1) or drawn by a seed (2).

from nlp_gait import gaitbench

problem = gaitbench.load("ssp-v5")          # gaitbench.names(subset="small" | "full")
f, violation = problem(X)                   # X: (P, n)
problem.best_known, problem.best_x, str(problem.evidence)
problem = gaitbench.load_front("ssp-power-time")  # two objectives; gaitbench.fronts() has all
problem = gaitbench.generate("ssp", seed=3)  # the same as load("gb2:ssp:3"); gaitbench.families() has the others
"""

from nlp_gait.gaitbench.facts import Definition, Evidence, Features, names
from nlp_gait.gaitbench.fronts import FrontInstance, FrontQuality, fronts, load_front
from nlp_gait.gaitbench.generated import families, list_test_seeds
from nlp_gait.gaitbench.instance import Instance, generate, load

__all__ = [
    "Definition",
    "Evidence",
    "Features",
    "FrontInstance",
    "FrontQuality",
    "Instance",
    "families",
    "fronts",
    "generate",
    "list_test_seeds",
    "load",
    "load_front",
    "names",
]
