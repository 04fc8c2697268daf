"""GaitBench: frozen, constrained problems that cost microseconds and whose optimum is known.

from nlp_gait import gaitbench

problem = gaitbench.load("ssp-v5")          # gaitbench.names(subset="small" | "full")
f, violation = problem(X)                   # X: (P, n)
problem.best_known, problem.best_x, str(problem.evidence)
"""

from nlp_gait.gaitbench.definitions import Definition, names
from nlp_gait.gaitbench.facts import Evidence
from nlp_gait.gaitbench.instance import Instance, load

__all__ = ["Definition", "Evidence", "Instance", "load", "names"]
