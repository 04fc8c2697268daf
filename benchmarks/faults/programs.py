"""Faulty programs as solvers of one study: whatever they do, the runs of the others stay the same.

``python -m benchmarks.faults.programs [--count 100] [--seed 1]`` writes as many small programs, each with a fault (silent, slow,
dead, NaN, wrong counts, partial lines, megabytes, forking ...) after some good answers, runs them in one study beside PSO, and
compares PSO's record with that of a study of its own.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import tempfile
import time
from collections import Counter
from contextlib import chdir
from pathlib import Path

from compare.study.record import RunRecord
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec, Stop

PROGRAM = """
import json, os, random, signal, subprocess, sys, time
problem = json.loads(sys.stdin.readline())
lower, upper, rng = problem["lower"], problem["upper"], random.Random({seed})
def draw(rows):
    return [[rng.uniform(*ends) for ends in zip(lower, upper)] for _ in range(rows)]
for _ in range({good}):
    print(json.dumps({{"x": draw(5)}}), flush=True)
    sys.stdin.readline()
def send(text):
    sys.stdout.write(text); sys.stdout.flush()
{fault}
"""
FAULTS = {
    "silent": "time.sleep(60)",
    "slow": "while True:\n    time.sleep(3); send(json.dumps({'x': draw(1)}) + '\\n'); sys.stdin.readline()",
    "never reads": "while True:\n    send(json.dumps({'x': draw(3)}) + '\\n')",
    "dead": "sys.exit(rng.randint(1, 255))",
    "killed": "os.kill(os.getpid(), signal.SIGKILL)",
    "raises": "raise ValueError('broken ' * rng.randint(1, 1000))",
    "segmentation fault": "os.kill(os.getpid(), signal.SIGSEGV)",
    "wrong count": "send(json.dumps({'x': [point + [0.0] for point in draw(2)]}) + '\\n')",
    "ragged": "send(json.dumps({'x': [draw(1)[0], draw(1)[0][1:]]}) + '\\n')",
    "no points": "send('{\"x\": []}\\n')",
    "NaN": "send(json.dumps({'x': [[float('nan')] * len(lower)]}) + '\\n')",
    "infinite": "send(json.dumps({'x': [[float('inf')] * len(lower)]}) + '\\n')",
    "outside": "send(json.dumps({'x': [[b + rng.uniform(0.1, 1e6) for b in upper]]}) + '\\n')",
    "texts": "send(json.dumps({'x': [['1'] * len(lower)]}) + '\\n')",
    "null": "send('null\\n')",
    "no JSON": "send('hello\\n')",
    "bytes": "sys.stdout.buffer.write(bytes(rng.randrange(256) for _ in range(1000)) + b'\\n'); sys.stdout.flush()",
    "partial line": "send('{\"x\": [[0.1, ')",
    "nested": "send('[' * 100000 + '\\n')",
    "megabytes of a line": "send('1' * 100_000_000)",
    "megabytes of lines": "send('{}\\n' * 10_000_000)",
    "megabytes of messages": "sys.stderr.write('x' * 50_000_000); sys.exit(1)",
    "many points": "send(json.dumps({'x': draw(20_000)}) + '\\n'); sys.stdin.readline()",
    "closes its output": "os.close(1); time.sleep(60)",
    "closes its input": "os.close(0); send(json.dumps({'x': draw(5)}) + '\\n'); time.sleep(60)",
    "leaves a child": "subprocess.Popen(['sleep', '60']); sys.exit(0)",
    "forks and dies": "[os.fork() for _ in range(4)]; os.abort()",
    "ignores the end": "while True:\n    send(json.dumps({'x': draw(50)}) + '\\n'); sys.stdin.readline()",
    "stop of no text": "send(json.dumps({'stop': [1, {'a': None}]}) + '\\n')",
    "writes files": "open('records', 'w').write('x')",
}


def run_pso_beside(programs: dict[str, Path], folder: Path) -> list[RunRecord]:
    """Run PSO and the programs in one study; return all records."""
    own = [
        SolverSpec(name=f"cmd:{sys.executable} {path}", label=label.replace(" ", "_"))
        for label, path in programs.items()
    ]
    settings = StudySettings(
        problems=(ProblemSpec(name="walk12"),),
        solvers=(SolverSpec(name="pso"), *own),
        runs=1,
        starts=1,
        stop=Stop(evaluations=300, time_limit_s=4.0),
    )
    return run_study(Study(tasks=settings.tasks(), folder=folder, jobs=2))


def main() -> None:
    """Print what became of the programs of each kind; end with status 1 if another run was touched."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.faults.programs", description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng, kinds = random.Random(arguments.seed), list(FAULTS)
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        programs = {}
        for k in range(arguments.count):
            kind = kinds[k % len(kinds)]
            text = PROGRAM.format(seed=rng.randrange(1000), good=rng.choice([0, 1, 5]), fault=FAULTS[kind])
            programs[f"{kind} {k}"] = Path(folder) / f"faulty{k}.py"
            programs[f"{kind} {k}"].write_text(text)
        alone = run_pso_beside({}, Path(folder) / "alone")
        started = time.perf_counter()
        records = run_pso_beside(programs, Path(folder) / "beside")
        seconds = time.perf_counter() - started
        counts: Counter[tuple[str, str]] = Counter()
        for record in records:
            kind = record.solver.rpartition("_")[0].replace("_", " ")
            counts[kind, "failed: " + record.status[:60] if not record.x else "has a point: " + record.status[:40]] += 1
        for (kind, what), count in sorted(counts.items()):
            print(f"{count:3d} {kind or 'pso':22s} {what}")
        pso = [json.dumps(r.to_json()["x"]) for r in records if r.solver == "pso"]
        same = pso == [json.dumps(r.to_json()["x"]) for r in alone]
        summary = f"{arguments.count} programs, {len(records)} records, {seconds:.0f} s; PSO's run is"
        print(summary, "the same" if same else "NOT the same")
        sys.exit(0 if same and len(records) == arguments.count + 1 else 1)


if __name__ == "__main__":
    main()
