"""Mutation testing: small errors put into the code one at a time; a test that stands for that code must find each.

    python -m benchmarks.faults.mutants compare/analysis/statistics --tests tests/compare/analysis

Works in a copy of the tree. Prints every survivor with its line; exit status 1 if there is one. Some survivors are equivalent
to the original, which only a reader can tell.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
TIME_LIMIT_S = 60.0
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
        for i in range(len(node.keywords)):
            yield _with(node, keywords=node.keywords[:i] + node.keywords[i + 1 :])
    elif isinstance(node, ast.Return) and node.value is not None:
        yield _with(node, value=ast.Constant(value=None))


def mutants(text: str) -> Iterator[tuple[int, str, str]]:
    """Line, what was changed, and the text of every mutant of a module."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        for name, field in ast.iter_fields(node):
            for i, child in enumerate(field if isinstance(field, list) else [field]):
                if not isinstance(child, ast.AST) or isinstance(child, ast.arg) or name in ("annotation", "returns"):
                    continue
                for wrong in variants(child):
                    _put(node, name, i, wrong)
                    line = getattr(child, "lineno", 0)
                    yield line, f"{_short(child)}  ->  {_short(wrong)}", ast.unparse(ast.fix_missing_locations(tree))
                    _put(node, name, i, child)


def survives(tests: list[str]) -> bool:
    """Whether the tests pass in a process of its own, in time."""
    child = os.fork()
    if child == 0:
        os.setsid()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        import pytest

        os._exit(int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests])))
    end = time.monotonic() + TIME_LIMIT_S
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) == 0
        time.sleep(0.02)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return False


def main() -> None:
    """Try all mutants of the modules."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="+", help="files or folders, relative to the root of the tree")
    parser.add_argument("--tests", nargs="+", required=True)
    parser.add_argument("--again", type=Path, help="output of an earlier run: try its survivors only")
    arguments = parser.parse_args()
    wanted = set(arguments.again.read_text().splitlines()) if arguments.again else None
    import casadi  # noqa: F401  # once, for all forks
    import pytest  # noqa: F401
    import scipy.stats  # noqa: F401

    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".*", "__pycache__", "docs"))
        os.chdir(tree)
        sys.dont_write_bytecode = True
        sys.path[:0] = [str(tree)]
        if not survives(arguments.tests):
            raise SystemExit("the tests fail without any mutant")
        total, survivors = 0, 0
        paths = [
            p
            for name in arguments.modules
            for p in (sorted(Path(name).rglob("*.py")) if Path(name).is_dir() else [Path(name)])
        ]
        for path in paths:
            original = path.read_text(encoding="utf-8")
            for line, change, text in mutants(original):
                name = f"{path}:{line}: {change}"
                if wanted is not None and name not in wanted:
                    continue
                path.write_text(text, encoding="utf-8")
                total += 1
                if survives(arguments.tests):
                    survivors += 1
                    print(name, flush=True)
            path.write_text(original, encoding="utf-8")
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
