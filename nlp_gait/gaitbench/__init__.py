"""GaitBench: constrained problems that cost microseconds and whose optimum is known, frozen (1) or drawn by a seed (2).

from nlp_gait import gaitbench

problem = gaitbench.load("ssp-v5")          # gaitbench.list_instances(subset="small" | "full")
f, violation = problem(X)                   # X: (P, n)
problem.best_known, problem.best_x, str(problem.evidence)
problem = gaitbench.generate("ssp", seed=3)  # the same as load("gb2:ssp:3"); gaitbench.list_families() has the others
"""

from nlp_gait.gaitbench.facts import Definition, Evidence, list_instances
from nlp_gait.gaitbench.generated import list_families
from nlp_gait.gaitbench.instance import Instance, generate, load

__all__ = ["Definition", "Evidence", "Instance", "generate", "list_families", "list_instances", "load"]
