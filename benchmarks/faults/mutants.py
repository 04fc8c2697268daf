"""Mutation testing: small errors put into the code one at a time; a test that stands for that code must find each.

    python -m benchmarks.faults.mutants compare/analysis/record_statistics.py --tests tests/compare/analysis
    python -m benchmarks.faults.mutants --sample 15 [NAME ...]

With ``--sample`` so many mutants are drawn of each module of ``BELONGING``, or of those whose path holds a name, and the tests
are those that belong to it. Works in a copy of the tree. Prints every survivor with its line; exit status 1 if there is one. Some
survivors are equivalent to the original, which only a reader can tell.
"""

from __future__ import annotations

import argparse
import ast
import copy
import math
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
# A mutant that needs so many times what the tests take without it, and some seconds, is counted as killed: of processor time, as
# the machine's load does not count, and of time on the wall, for one that waits for ever.
CPU_TIMES, CPU_MORE_S, WALL_TIMES, WALL_MORE_S = 4, 10, 8, 60
# Tests that stand for a module, by its path: those of the formulas and of what came after the first run.
BELONGING: dict[str, tuple[str, ...]] = {
    "nlp_gait/symbolic/trajectories.py": ("tests/symbolic/test_splines.py", "tests/gaits/nao/test_curves.py"),
    "nlp_gait/symbolic/quantised.py": ("tests/symbolic/test_quantised.py", "tests/gaits/stairs/test_track.py"),
    "nlp_gait/gaits/stairs/planned_motion.py": ("tests/gaits/stairs/test_planned_motion.py",),
    "nlp_gait/gaits/stairs/leg_network.py": ("tests/gaits/stairs/test_leg_network.py",),
    "nlp_gait/gaits/stairs/stair.py": ("tests/gaits/stairs/test_plan.py", "tests/gaits/stairs/test_planned_motion.py"),
    "nlp_gait/gaits/biped/goals.py": ("tests/gaits/nao/test_motor_model.py",),
    "nlp_gait/gaits/nao/body.py": ("tests/gaits/nao/test_motor_model.py", "tests/gaits/nao/test_golden.py"),
    "nlp_gait/gaits/biped/cycle.py": ("tests/gaits/nao/test_cycle.py",),
    "nlp_gait/gaits/biped/cycle_motion.py": ("tests/gaits/nao/test_cycle.py",),
    "nlp_gait/gaits/biped/cart_table.py": ("tests/gaits/nao/test_cart_table.py",),
    "nlp_gait/symbolic/general_leg.py": ("tests/symbolic/test_general_leg.py",),
    "nlp_gait/proofs/affine.py": ("tests/proofs/test_affine.py",),
    "nlp_gait/proofs/guarantee.py": ("tests/proofs/test_guarantee.py",),
    "nlp_gait/proofs/time_search.py": ("tests/proofs/test_guarantee.py",),
    "nlp_gait/backends/derivatives/plan.py": ("tests/backends/derivatives/test_compiled_nlp.py",),
    "nlp_gait/backends/solvers/working_set.py": ("tests/backends/solvers/test_working_set.py",),
    "nlp_gait/simulation/drive.py": ("tests/simulation/test_drive.py", "tests/simulation/test_walking.py"),
    "nlp_gait/simulation/measurements.py": ("tests/simulation/test_measurements.py",),
    "nlp_gait/user_code.py": ("tests/formulation/test_user_problems.py", "tests/compare/cli/test_user_code.py"),
    "nlp_gait/formulation/locking.py": ("tests/faults/test_together.py",),
    "nlp_gait/gaitbench/instance.py": ("tests/gaitbench/test_instances.py",),
    "nlp_gait/gaitbench/suite_problem.py": ("tests/gaitbench/test_instances.py",),
    "nlp_gait/gaitbench/facts.py": ("tests/gaitbench/test_instances.py",),
    "nlp_gait/gaitbench/c_export.py": ("tests/gaitbench/test_c_export.py",),
    "nlp_gait/gaitbench/adapters": ("tests/gaitbench/test_adapters.py",),
    "compare/bench/leaderboard.py": ("tests/compare/bench/test_bench.py",),
    "nlp_gait/files.py": ("tests/faults/test_disk.py", "tests/faults/test_power_cuts.py"),
    "compare/study/run_task.py": (
        "tests/compare/study/test_run_isolated.py",
        "tests/compare/study/test_gradient_runs.py",
    ),
    "nlp_gait/processes.py": ("tests/compare/study/test_run_isolated.py", "tests/backends/test_starts.py"),
    "compare/study/import_runs.py": ("tests/compare/study/test_import_runs.py",),
    "compare/study/store.py": ("tests/compare/study/test_store.py",),
    "compare/logs.py": ("tests/compare/test_logs.py",),
}
OPERATORS: dict[type[ast.AST], tuple[type[ast.AST], ...]] = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.FloorDiv: (ast.Div,),
    ast.Pow: (ast.Mult,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
}
NAMES = {
    "min": "max",
    "max": "min",
    "floor": "ceil",
    "minimum": "maximum",
    "maximum": "minimum",
    "all": "any",
    "any": "all",
}
NAMES |= {"sf": "cdf", "cdf": "sf", "isfinite": "isnan", "isnan": "isfinite"}
# Arguments on which no result depends: whether assignment and positional arguments are allowed, checks, texts, sizes of caches.
CONVENTIONS = ("frozen", "kw_only", "slots", "eq", "strict", "encoding", "maxsize")
STRINGS = {"left": "right", "right": "left", "two-sided": "less"}


def variants(node: ast.AST) -> Iterator[ast.AST]:
    """Wrong versions of a node, without its children's."""
    if isinstance(node, (ast.BinOp, ast.BoolOp)):
        for other in OPERATORS.get(type(node.op), ()):
            yield _with(node, op=other())
    elif isinstance(node, ast.Compare):
        for i, op in enumerate(node.ops):
            for other in OPERATORS.get(type(op), ()):
                yield _with(node, ops=[*node.ops[:i], other(), *node.ops[i + 1 :]])
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not)):
        yield node.operand
    elif isinstance(node, (ast.If, ast.IfExp)):
        yield _with(node, test=ast.UnaryOp(op=ast.Not(), operand=node.test))
    elif isinstance(node, ast.Constant):
        if isinstance(node.value, bool):
            yield ast.Constant(value=not node.value)
        elif isinstance(node.value, (int, float)):
            yield ast.Constant(value=node.value + 1)
        elif node.value in STRINGS:
            yield ast.Constant(value=STRINGS[node.value])
    elif isinstance(node, ast.Name) and node.id in NAMES:
        yield _with(node, id=NAMES[node.id])
    elif isinstance(node, ast.Attribute) and node.attr in NAMES:
        yield _with(node, attr=NAMES[node.attr])
    elif isinstance(node, ast.Call):
        for i in (k for k, keyword in enumerate(node.keywords) if keyword.arg not in CONVENTIONS):
            yield _with(node, keywords=node.keywords[:i] + node.keywords[i + 1 :])
    elif isinstance(node, ast.Return) and getattr(node.value, "value", node.value) is not None:
        yield _with(node, value=ast.Constant(value=None))


def mutants(text: str) -> Iterator[tuple[int, str, str]]:
    """Line, what was changed, and the text of every mutant of a module."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg in CONVENTIONS:
            continue
        for name, field in ast.iter_fields(node):
            for i, child in enumerate(field if isinstance(field, list) else [field]):
                if not isinstance(child, ast.AST) or isinstance(child, ast.arg) or name in ("annotation", "returns"):
                    continue
                for wrong in variants(child):
                    _put(node, name, i, wrong)
                    line = getattr(child, "lineno", 0)
                    yield line, f"{_short(child)}  ->  {_short(wrong)}", ast.unparse(ast.fix_missing_locations(tree))
                    _put(node, name, i, child)


class Limits(NamedTuple):
    """Of one run of the tests [s]."""

    cpu_s: float
    wall_s: float


def survives(tests: Sequence[str], marks: str, limits: Limits) -> bool:
    """Whether the tests pass in a process of its own, in time."""
    child = os.fork()
    if child == 0:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limits.cpu_s),) * 2)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        status = 1
        try:
            import pytest

            status = int(pytest.main(["-x", "-q", "-n", "0", "-p", "no:cacheprovider", "-m", marks, *tests]))
        finally:
            os._exit(status)
    end = time.monotonic() + limits.wall_s
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) == 0
        time.sleep(0.02)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return False


def limits_of(module: str, tests: Sequence[str], marks: str) -> Limits:
    """From what the tests take without a mutant."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    if not survives(tests, marks, Limits(3600.0, 3600.0)):
        raise SystemExit(f"{module}: the tests fail without any mutant")
    after, took = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic() - began
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Limits(CPU_MORE_S + CPU_TIMES * cpu, WALL_MORE_S + WALL_TIMES * took)


def tried(
    module: str, tests: Sequence[str], marks: str, sample: int | None, seed: int, wanted: set[str] | None
) -> tuple[int, int]:
    """How many mutants of a file or folder were tried, and how many survived; each of these is printed."""
    limits = limits_of(module, tests, marks)
    paths = sorted(Path(module).rglob("*.py")) if Path(module).is_dir() else [Path(module)]
    originals = {path: path.read_text(encoding="utf-8") for path in paths}
    found = [(path, *mutant) for path in paths for mutant in mutants(originals[path])]
    if sample is not None and sample < len(found):
        found = random.Random(f"{module} {seed}").sample(found, sample)
    if wanted is not None:
        found = [m for m in found if f"{m[0]}:{m[1]}: {m[2]}" in wanted]
    survivors = 0
    for tried_before, (path, line, change, text) in enumerate(found):
        path.write_text(text, encoding="utf-8")
        os.utime(
            path, (tried_before, tried_before)
        )  # else a compiled file of an earlier mutant may be taken for this one's
        if survives(tests, marks, limits):
            survivors += 1
            print(f"{path}:{line}: {change}", flush=True)
        path.write_text(originals[path], encoding="utf-8")
    print(f"{module}: {len(found)} mutants, {len(found) - survivors} killed, {survivors} survived", flush=True)
    return len(found), survivors


def main() -> None:
    """Try all mutants of the modules, or some."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", help="files or folders, relative to the root of the tree")
    parser.add_argument("--tests", nargs="+")
    parser.add_argument("--sample", type=int, help="mutants of each module, with the tests that belong to it")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--fast", action="store_true", help="without the tests that are marked as slow")
    parser.add_argument("--again", type=Path, help="output of an earlier run: try its survivors only")
    arguments = parser.parse_args()
    if arguments.tests and arguments.modules:
        chosen = dict.fromkeys(arguments.modules, tuple(arguments.tests))
    elif arguments.tests:
        raise SystemExit("--tests needs the modules that they stand for")
    else:
        names = arguments.modules or [""]
        chosen = {module: tests for module, tests in BELONGING.items() if any(name in module for name in names)}
    wanted = set(arguments.again.read_text().splitlines()) if arguments.again else None
    import casadi  # noqa: F401  # once, for all forks
    import matplotlib.pyplot  # noqa: F401
    import pytest  # noqa: F401
    import scipy.optimize  # noqa: F401
    import scipy.stats  # noqa: F401

    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".*", "__pycache__"))
        os.chdir(tree)
        sys.dont_write_bytecode = True
        sys.path[:0] = [str(tree)]
        marks = "not slow" if arguments.fast else ""
        counts = [tried(m, tests, marks, arguments.sample, arguments.seed, wanted) for m, tests in chosen.items()]
    total, survivors = (sum(column) for column in zip(*counts, strict=True))
    print(f"{total} mutants, {total - survivors} killed, {survivors} survived")
    if survivors:
        raise SystemExit(1)


def _with(node: ast.AST, **fields: object) -> ast.AST:
    changed = copy.copy(node)
    for name, value in fields.items():
        setattr(changed, name, value)
    return changed


def _put(node: ast.AST, name: str, i: int, child: ast.AST) -> None:
    field = getattr(node, name)
    if isinstance(field, list):
        field[i] = child
    else:
        setattr(node, name, child)


def _short(node: ast.AST) -> str:
    return ast.unparse(ast.fix_missing_locations(copy.deepcopy(node))).splitlines()[0][:100]


if __name__ == "__main__":
    main()
