"""A solver in C that plans again for changed parameters, on the exported NLP; needs only libc and libm."""

from collections.abc import Callable, Mapping

import casadi as ca
from casadi import SX

from nlp_gait.backends.derivatives import plan as derivatives
from nlp_gait.backends.derivatives.assembly import NlpPlan
from nlp_gait.backends.derivatives.compiled import write_array
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.nlp import NlpModel, build_nlp
from nlp_gait.errors import InputError
from nlp_gait.export.c_files import format_comment
from nlp_gait.formulation import Array, GaitProblem, InstantPoint
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, Outcome
from nlp_gait.symbolic.tape import simplify

# Files by their templates, in addition to those of the NLP.
TEMPLATES = {
    "{prefix}_planner.h": "planner.h.in",
    "{prefix}_planner.c": "planner.c.in",
    "dense.h": "dense.h",
    "plan.c": "planner_main.c.in",
}
BUILD = """${{CC:-cc}} {flags} $CFLAGS -fPIC -c -o {prefix}_planner.o {prefix}_planner.c
${{CC:-cc}} -shared -o lib{prefix}_planner.so {prefix}_planner.o {prefix}.o -lm
${{CC:-cc}} -std=c99 -O2 -o plan plan.c {prefix}_planner.o {prefix}.o -lm
"""
FLAGS = "-std=c99 -O3 -fno-math-errno -ffp-contract=off"
MOST_VARIABLES, MOST_LIFTED = 60, 2000  # programs are dense
MOTION = ("q", "qd", "tau", "zmp")  # at any time


def check_planner(problem: GaitProblem) -> None:
    """Raise InputError if no planner in C can be written for a problem."""
    model = build_nlp(problem)
    first, n = len(model.row_names), model.variables
    if n > MOST_VARIABLES or model.lifted > MOST_LIFTED:
        raise InputError(
            f"{problem.name} has {n} variables and {model.lifted} lifted ones; a planner in C has at most {MOST_VARIABLES} "
            f"and {MOST_LIFTED}: use nlp_gait.replanner"
        )
    # Each lifted variable must depend on earlier ones only, so that one substitution after another finds all.
    for row, column in zip(*ca.jacobian_sparsity(model.nlp["g"], model.nlp["x"]).get_triplet(), strict=True):
        if row >= first and column - n > model.tie_owner[row - first]:
            raise InputError(
                f"{problem.name} solves equations within its motion, which a planner in C cannot; use nlp_gait.replanner"
            )


def describe_planner(
    problem: GaitProblem, model: NlpModel, found: NlpPlan, prefix: str, near: Outcome
) -> Mapping[str, str]:
    """Return the words of the templates; raises InputError if ``near`` is not an optimum, or as ``check_planner``."""
    check_planner(problem)
    if near.guess is None or not near.converged:
        raise InputError(f"{problem.name}: a planner begins from an optimum by IPOPT; it {near.status}")
    functions = []
    for each in (model.row_bounds, model.lift_start):  # with the prefix in their names
        inputs = each.mx_in()
        functions.append(ca.Function(f"{prefix}_{each.name()}", inputs, each.call(inputs, True, False)))
    joints: tuple[str, ...] = ()
    if problem.display.at_time is not None:
        functions.append(_make_motion(problem, problem.display.at_time, prefix))
        joints = problem.signals(near.x).joints
    writer = ca.CodeGenerator(f"{prefix}_functions", {"with_header": False})
    for function in functions:
        writer.add(function)
    first = len(model.row_names)
    constants = {
        "tie_upper": ("double", map(derivatives.format_number, model.tie_upper.tolist())),
        "tie_owner": ("int", model.tie_owner.tolist()),
        "lift_sense": ("double", map(derivatives.format_number, model.lift_sense.tolist())),
        "row_scale": ("double", map(derivatives.format_number, build_exact_model(problem).row_scales[:first].tolist())),
    }
    optimum = {"x": near.x, "multipliers": near.guess.rows}
    return {
        "OWN": str(len(problem.p)),
        "FIRST": str(first),
        "TOLERANCE": repr(FEASIBILITY_TOLERANCE),
        "CONSTANTS": "\n".join(
            [
                *(write_array(kind, name, values) for name, (kind, values) in constants.items()),
                *(_write_public(f"{prefix}_{name}", values) for name, values in optimum.items()),
            ]
        ),
        "FUNCTIONS": writer.dump(),
        "COUNTS": format_comment(_count_parts(model, found)),
        "CASADI_NUMBERS": str(max(1, *(function.sz_w() for function in functions))),
        "CASADI_INTEGERS": str(max(1, *(function.sz_iw() for function in functions))),
        "CASADI_ARGUMENTS": str(max(function.sz_arg() for function in functions)),
        "CASADI_RESULTS": str(max(function.sz_res() for function in functions)),
        "PARAMETER_NAMES": ", ".join(f'"{parameter.name}"' for parameter in problem.parameters),
        "JOINTS": str(len(joints)),
        "JOINT_NAMES": ", ".join(joints) or "none",
        "PLANNER": BUILD.format(prefix=prefix, flags=FLAGS),
    }


def _write_public(name: str, values: Array) -> str:
    return write_array("double", name, map(derivatives.format_number, values.tolist())).removeprefix("static ")


def _make_motion(
    problem: GaitProblem, at_time: Callable[[InstantPoint, SX], Mapping[str, SX]], prefix: str
) -> ca.Function:
    """Return a function of x, p and a time to joint angles, rates, torques and ZMP."""
    names = [parameter.name for parameter in problem.parameters]
    x, p, t = SX.sym("x", len(problem.names)), SX.sym("p", len(names)), SX.sym("t")
    found = at_time(InstantPoint.of(x, p, problem.names, names), t)
    return ca.Function(f"{prefix}_motion", [x, p, t], simplify([ca.densify(found[name]) for name in MOTION]))


def _count_parts(model: NlpModel, found: NlpPlan) -> list[str]:
    """Return lines with the number of operations of a step's parts."""
    n, lifted, rows = model.variables, model.lifted, len(model.row_names) + len(model.tie_upper)
    by_lifted = found.jacobian.nnz() - found.jacobian.colind()[n]
    reduction = 2 * (by_lifted * 2 * (n + 1) + 2 * found.hessian.nnz() * n + lifted * n * (n + 1))
    parts = {
        "values of all functions": _count(found.plan, derivatives.VALUES),
        "first derivatives, in addition": _count(found.plan, derivatives.FIRST),
        "second derivatives, in addition": _count(found.plan, derivatives.SECOND),
        "elimination of the lifted variables": reduction,
        "eigenvectors of the curvature, four times": 4 * 30 * 6 * n**3,
        "a change of the program's active rows, with r variables kept": 0,
    }
    *others, last = parts
    return [
        *(f"{parts[name]:10d}  {name}" for name in others),
        f"14 q^2 + 2 q a  {last}: q = {n + 1} + r, a <= {rows} rows",
        "A step needs derivatives once, values at most 20 times (5 lengths, 4 evaluations each), and at most 30 programs, each",
        f"with at most 2 q + {10 * (n + lifted + 100)} changes; typically 1 or 2 programs and {n} changes.",
    ]


def _count(plan: derivatives.DerivativePlan, phase: int) -> int:
    """Count a phase's additions, multiplications and functions."""
    total = 0
    for kind, first, last in plan.steps[phase]:
        if kind == derivatives.TAPE:
            total += last - first
        elif kind == derivatives.RUNS:
            total += sum(2 * length for *_, length in plan.runs[first:last])
        elif kind == derivatives.PRODUCTS:
            total += sum(1 + 2 * length for *_, length in plan.products[first:last])
        elif kind == derivatives.CALL:
            call = plan.calls[first]
            times = call.samples if call.directions is None else int(call.directions.sum())
            total += times * plan.functions[call.function].n_instructions()
    return total
