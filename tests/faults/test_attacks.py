"""No user code judges itself."""

import re
from pathlib import Path

import numpy as np
import pytest

from compare.study.run import ProblemSpec, Run, Stop
from nlp_gait import load
from tests.compare.records import run_once

CODE = {
    "points that are truth values": "f(lower > 0)",
    "more than its budget": "[f(lower) for _ in range(10**5)]",
    "a judge of its own": "f(lower)\n    import compare.study.perform as r\n    r.evaluate = lambda p, x: None",
    "values of its own": "f(lower)\n    import gc\n    for o in gc.get_objects():\n"
    "        if type(o).__name__ == 'Evaluator': o.best, o.evaluations, o.best_x = (0.0, -9.0), 1, lower",
    "a channel of its own": "import os\n    [os.write(int(d), b'x') for d in os.listdir('/proc/self/fd') if int(d) > 2]",
    "another record": "import compare.study.record as r\n    f(lower)\n    r.RunRecord.to_json = lambda s: {'schema': 5}",
}  # fmt: skip


@pytest.mark.parametrize("name", CODE)
def test_no_code_judges_itself(name: str, tmp_path: Path) -> None:
    """What is recorded is evaluated and counted by this process, or the run has failed."""
    path = tmp_path / f"{re.sub('[^a-z]', '_', name)}.py"
    path.write_text(f"def search(f, lower, upper, evaluations, seed):\n    {CODE[name]}\n")
    record = run_once(Run(problem=ProblemSpec(name="walk12"), solver=f"{path}:search", stop=Stop(evaluations=20)))
    if not record.x:
        assert record.status.startswith("failed: ")
        return
    assert record.counts == {"f": 20 if name == "more than its budget" else 1}
    np.testing.assert_array_equal(list(record.x.values()), load("walk12").lower)
