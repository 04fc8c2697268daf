"""Runs as the logs that other packages read: IOHprofiler's JSON, and the files of COCO.

What is logged is the relative gap to the best known objective, positive if worse; until something feasible was found it is
``NOTHING_FEASIBLE``. Evaluations are equivalent ones, in which derivatives count as forward differences would.
"""

from compare.logs.coco import write_coco
from compare.logs.ioh import write_ioh
from compare.logs.trace import NOTHING_FEASIBLE, Trace, traces

__all__ = ["NOTHING_FEASIBLE", "Trace", "traces", "write_coco", "write_ioh"]
