"""Export of a problem's NLP as an ``.nl`` file, which AMPL's solvers read, with names and the best known value."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from nlp_gait.backends.nlp import build_nlp
from nlp_gait.errors import InputError
from nlp_gait.export.c_files import MARK
from nlp_gait.files import check_output, make_writable_folder, write_json, write_text
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.symbolic.tape import Instruction, read_tape

# Operations of the format, by CasADi's. Minima by absolute values: many readers have neither minima nor conditions.
_OPERATIONS = """ADD:o0 {0} {1}|SUB:o1 {0} {1}|MUL:o2 {0} {1}|DIV:o3 {0} {1}|FMOD:o4 {0} {1}|POW:o5 {0} {1}|CONSTPOW:o5 {0} {1}
FMIN:o2 n0.5 o1 o0 {0} {1} o15 o1 {0} {1}|FMAX:o2 n0.5 o0 o0 {0} {1} o15 o1 {0} {1}|FLOOR:o13 {0}|CEIL:o14 {0}
FABS:o15 {0}|NEG:o16 {0}|LT:o35 o22 {0} {1} n1 n0|LE:o35 o23 {0} {1} n1 n0|TANH:o37 {0}|TAN:o38 {0}|SQRT:o39 {0}
SINH:o40 {0}|SIN:o41 {0}|LOG:o43 {0}|EXP:o44 {0}|COSH:o45 {0}|COS:o46 {0}|ATANH:o47 {0}|ATAN2:o48 {0} {1}
ATAN:o49 {0}|ASINH:o50 {0}|ASIN:o51 {0}|ACOSH:o52 {0}|ACOS:o53 {0}|SQ:o5 {0} n2|TWICE:o2 n2 {0}|INV:o3 n1 {0}
ASSIGN:{0}"""
OPERATIONS = {
    getattr(ca, f"OP_{name}"): text.replace(" ", "\n")
    for name, _, text in (line.partition(":") for line in _OPERATIONS.replace("\n", "|").split("|"))
}


@lock_casadi
def export_nl(problem: GaitProblem, folder: Path, best_known: Mapping[str, Any]) -> list[Path]:
    """Write the ``.nl`` file of a problem's NLP, names of its columns and rows, and a JSON file; return their paths.

    The NLP is that of the solvers: scaled variables, then those of lifted operations. The JSON file has offset and scale of the
    variables, and ``known``, facts such as the best known value. Raises InputError for an operation that the format does not
    have, or OutputError, also for a file of another program under one of the names.
    """
    model = build_nlp(problem)
    prefix, width = f"{problem.name.replace('-', '_')}_nlp", model.widths[-1]
    nlp = ca.Function("nlp", [model.nlp["x"], model.nlp["p"]], [model.nlp["f"], model.nlp["g"]]).expand()
    w = ca.SX.sym("w", nlp.size1_in(0))
    results = ca.cse(nlp.call([w, ca.SX(np.append(problem.p, width))]))
    bounds = model.bounds(problem)
    start = model.start(problem, (problem.lower + problem.upper) / 2, width)
    columns = [*problem.names, *(f"lifted[{k}]" for k in range(model.lifted))]
    rows = [*model.row_names, *(f"lift[{k}]" for k in range(len(model.tie_upper)))]
    texts = {
        "nl": write_nl(ca.Function("nlp", [w], results), bounds, start, f"nlp-gait {problem.address}"),
        "col": "\n".join([*columns, ""]),
        "row": "\n".join([*rows, problem.objective.name, ""]),
    }
    paths = {ending: make_writable_folder(folder) / f"{prefix}.{ending}" for ending in (*texts, "facts.json")}
    check_output(paths["nl"], MARK)
    for ending, text in texts.items():
        write_text(paths[ending], text)
    facts = {"problem": problem.address, "options": dict(problem.options), "parameters": dict(problem.values)}
    scales = {"offset": model.offset.tolist(), "scale": model.scale.tolist()}
    write_json(paths["facts.json"], {**facts, "objective": asdict(problem.objective), **best_known, **scales})
    return list(paths.values())


def write_nl(nlp: ca.Function, bounds: Mapping[str, Array], start: Array, title: str) -> str:
    """Return the text of an ``.nl`` file; raises InputError for an operation that the format does not have.

    Args:
        nlp: function of x (n,) to f and g (m,), of scalar operations.
        bounds: ``lbx``, ``ubx``, ``lbg``, ``ubg``.
        start: (n,) start point.
        title: first line's comment.

    Source:
        Gay (2005), Writing .nl files. All variables and rows count as nonlinear; values used twice are defined variables.
    """
    n, m = nlp.size1_in(0), nlp.size1_out(1)
    pattern = nlp.jac_sparsity(1, 0)
    defined, outputs = _write_expressions(list(read_tape(nlp)), n)
    equal = int(np.sum(bounds["lbg"] == bounds["ubg"]))
    ranges = int(np.sum(np.isfinite(bounds["lbg"]) & np.isfinite(bounds["ubg"]))) - equal
    sizes = f" {n} {m} 1 {ranges} {equal}\n {m} 1\n 0 0\n {n} {n} {n}\n 0 0 0 1\n 0 0 0 0 0\n {pattern.nnz()} {n}\n 0 0"
    lines = [f"g3 1 1 0\t# {title}", sizes, f" {len(defined)} 0 0 0 0", *defined]
    lines += [f"C{i}\n{outputs.get(i + 1, 'n0')}" for i in range(m)] + [f"O0 0\n{outputs.get(0, 'n0')}"]
    lines += [f"x{n}", *(f"{i} {value!r}" for i, value in enumerate(start.tolist()))]
    for kind in "gx":
        pairs = zip(bounds[f"lb{kind}"].tolist(), bounds[f"ub{kind}"].tolist(), strict=True)
        lines += ["r" if kind == "g" else "b", *(_format_bounds(*pair) for pair in pairs)]
    counts = np.cumsum(np.diff(pattern.colind()))[:-1]
    lines += [f"k{n - 1}", *map(str, counts.tolist())]
    transposed = pattern.T
    starts, columns = transposed.colind(), transposed.row()
    for i in range(m):
        entries = columns[starts[i] : starts[i + 1]]
        lines += [f"J{i} {len(entries)}", *(f"{column} 0" for column in entries)] if entries else []
    return "\n".join([*lines, f"G0 {n}", *(f"{i} 0" for i in range(n)), ""])


def _write_expressions(tape: list[Instruction], n: int) -> tuple[list[str], dict[int, str]]:
    """Return the definitions of values used more than once, and the expression of each output by its place."""
    twice = (ca.OP_FMIN, ca.OP_FMAX)  # use their arguments twice
    uses = Counter(place for node in tape for place in node.arguments * (1 + (node.operation in twice)))
    texts: dict[int, str] = {}
    defined, outputs = list[str](), dict[int, str]()
    for k, node in enumerate(tape):
        arguments = [texts[argument] for argument in node.arguments]
        if node.operation == ca.OP_OUTPUT:
            outputs[node.place] = arguments[0]
        elif node.operation == ca.OP_INPUT:
            texts[k] = f"v{node.place}"
        elif node.operation == ca.OP_CONST:
            texts[k] = f"n{node.constant!r}"
        elif node.operation not in OPERATIONS:
            raise InputError(f"an .nl file cannot express operation {node.operation} of CasADi")
        else:
            texts[k] = OPERATIONS[node.operation].format(*arguments)
            if uses[k] > 1:
                defined.append(f"V{n + len(defined)} 0 0\n{texts[k]}")
                texts[k] = f"v{n + len(defined) - 1}"
    return defined, outputs


def _format_bounds(lower: float, upper: float) -> str:
    if lower == upper:
        return f"4 {lower!r}"
    if np.isfinite(lower):
        return f"0 {lower!r} {upper!r}" if np.isfinite(upper) else f"2 {lower!r}"
    return f"1 {upper!r}" if np.isfinite(upper) else "3"
