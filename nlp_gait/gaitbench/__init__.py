"""GaitBench: constrained problems that cost microseconds and whose optimum is known, frozen (1) or drawn by a seed (2).

from nlp_gait import gaitbench

problem = gaitbench.load("ssp-v5")          # gaitbench.names(subset="small" | "full")
f, violation = problem(X)                   # X: (P, n)
problem.best_known, problem.best_x, str(problem.evidence)
problem = gaitbench.load_front("ssp-power-time")  # two objectives; gaitbench.fronts() has all
problem = gaitbench.generate("ssp", seed=3)  # the same as load("gb2:ssp:3"); gaitbench.families() has the others
"""

from nlp_gait.gaitbench.facts import Definition as Definition
from nlp_gait.gaitbench.facts import Evidence as Evidence
from nlp_gait.gaitbench.facts import Features as Features
from nlp_gait.gaitbench.facts import names as names
from nlp_gait.gaitbench.fronts import FrontInstance as FrontInstance
from nlp_gait.gaitbench.fronts import FrontQuality as FrontQuality
from nlp_gait.gaitbench.fronts import fronts as fronts
from nlp_gait.gaitbench.fronts import load_front as load_front
from nlp_gait.gaitbench.generated import families as families
from nlp_gait.gaitbench.generated import list_test_seeds as list_test_seeds
from nlp_gait.gaitbench.instance import Instance as Instance
from nlp_gait.gaitbench.instance import generate as generate
from nlp_gait.gaitbench.instance import load as load
