"""Validation of user-defined problems when they are made, rather than in the first solve."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np
from casadi import Function, vertcat

from nlp_gait.errors import InputError
from nlp_gait.formulation.assembly import Assembly
from nlp_gait.formulation.gait_problem import GaitProblem
from nlp_gait.symbolic.nonsmooth import Exact

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,63}")


def check_mathematics(problem: GaitProblem) -> None:
    """Assemble a problem once and check that backends can use it.

    Raises:
        InputError: no assembly, duplicated rows, symbols that are neither variables nor parameters, a bound of a row that
            depends on variables, or a start point of the wrong length.
    """
    owner = f"problem {problem.name!r}"
    if not NAME.fullmatch(problem.name):  # files are named after it
        raise InputError(f"{owner}: a name has 1 to 64 letters, digits and . _ + -, and starts with a letter or digit")
    if not problem.variables:
        raise InputError(f"{owner} has no variables")
    point = problem.symbols()
    assembly = problem.assemble(point, Exact())
    if not isinstance(assembly, Assembly):
        raise InputError(f"{owner}: assemble must return an Assembly, it returned {type(assembly).__name__}")
    counts = Counter(name for constraint in assembly.constraints for name in constraint.row_names)
    duplicates = [name for name, count in counts.items() if count > 1]
    if duplicates:
        raise InputError(f"{owner}: duplicated rows: {', '.join(duplicates[:5])}")
    inputs = {point.x.name(): point.x, point.p.name(): point.p}
    parts = {"objective": assembly.objective, **{f"index {name!r}": value for name, value in assembly.indexes.items()}}
    for constraint in assembly.constraints:
        row = f"constraint {constraint.name!r}"
        parts[row] = constraint.value
        for end in ("lower", "upper"):
            bound = getattr(constraint, end)
            if bound is None:
                continue
            parts[f"{row}, {end}"] = bound
            function = Function("bound", list(inputs.values()), [bound], {"allow_free": True})
            if function.sparsity_jac(0, 0).nnz():
                raise InputError(
                    f"{owner}: {row}: {end} must depend on parameters only; move terms with variables into value"
                )
    for part, value in parts.items():
        free = Function("part", list(inputs.values()), [vertcat(value)], {"allow_free": True}).free_mx()
        if free:
            raise InputError(
                f"{owner}: {part} contains {free[0].name()!r}, which is neither a variable nor a parameter"
            )
    if problem.hints.start is not None:
        start = np.asarray(problem.hints.start(problem.parameter_values, np.random.default_rng(0)))
        if start.shape != (len(problem.names),):
            raise InputError(f"{owner}: start must return {len(problem.names)} values, it returned shape {start.shape}")
