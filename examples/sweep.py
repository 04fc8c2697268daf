"""The true price of lifting the foot higher: IPOPT follows the optimum over the swing height.

python examples/sweep.py [FOLDER]
"""

import sys
from pathlib import Path

from compare.questions.sweep.report import sweep_answer
from compare.questions.sweep.study import parse_axis, sweep
from compare.study.task import ProblemSpec

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
spec = ProblemSpec(name="nao-ssp")
points = sweep(spec, [parse_axis("swing_height_m=0.015:0.028:3")], starts=2)
for point in points:
    print(f"{point.at['swing_height_m'] * 1000:.1f} mm: {point.objective:.5f} W, {point.status}")
print("wrote", *sweep_answer(points, spec.load(), "ipopt").write(folder))
