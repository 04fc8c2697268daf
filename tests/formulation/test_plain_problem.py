"""User-defined problems: three ways to state one are one problem, and what is not allowed is one sentence."""

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from casadi import MX, SX

import nlp_gait
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.registry import check_mathematics

BEAM = f"{Path(__file__).parents[2] / 'examples' / 'welded_beam.py'}:beam"
BEST = 1.724852308597366  # of the welded beam: Ragsdell, Phillips (1976); Coello (2000) and many others


def by_expressions(kind: Any = SX, **changes: Any) -> GaitProblem:
    """The point of the disk about (1, 0) with radius 2, above the line x + 2 y = c, that is nearest to (3, 3)."""
    x, y, c = (kind.sym(name) for name in ("x", "y", "c"))
    rows = {"disk": (x - 1) ** 2 + y**2 <= 4, "line": c <= x + 2 * y, "order": y <= x}
    given: dict[str, Any] = {"x": {"x": (-5, 5, "m"), "y": (-5, 5)}, "p": {"c": 1.0}, "unit": "m2"}
    return nlp_gait.problem((x - 3) ** 2 + (y - 3) ** 2, rows, **{**given, **changes})


def by_dictionary(kind: Any = MX) -> GaitProblem:
    x, c = kind.sym("x", 2), kind.sym("c")
    g = ca.vertcat((x[0] - 1) ** 2 + x[1] ** 2, x[0] + 2 * x[1] - c, x[1] - x[0])
    nlp = {"x": x, "f": (x[0] - 3) ** 2 + (x[1] - 3) ** 2, "g": g, "p": c}
    return nlp_gait.problem(nlp, p=1.0, lbx=-5, ubx=[5, 5], lbg=[-np.inf, 0, -np.inf], ubg=[4, np.inf, 0])


def by_opti() -> GaitProblem:
    opti = ca.Opti()
    x, y, c = opti.variable(), opti.variable(), opti.parameter()
    opti.set_value(c, 1.0)
    opti.minimize((x - 3) ** 2 + (y - 3) ** 2)
    opti.subject_to(opti.bounded(-5, x, 5))
    opti.subject_to([(x - 1) ** 2 + y**2 <= 4, x + 2 * y >= c, y <= x, opti.bounded(-5, y, 5)])
    return nlp_gait.problem(opti)


@pytest.mark.parametrize("make", [by_expressions, lambda: by_expressions(MX), by_dictionary, by_opti])
def test_three_ways_to_state_a_problem_are_one_problem(make: Any) -> None:
    """(3, 3) lies in the direction (2, 3) from the centre, sqrt(13) away."""
    problem = make()
    solution = nlp_gait.solve(problem, starts=3)
    assert solution.converged and solution.best.x == pytest.approx([1 + 4 / np.sqrt(13), 6 / np.sqrt(13)], abs=1e-6)
    assert solution.objective == pytest.approx((np.sqrt(13) - 2) ** 2)
    assert (problem.lower.tolist(), problem.upper.tolist()) == ([-5, -5], [5, 5])
    f, violation = nlp_gait.compile_objective(problem)(np.array([[2.0, 2.0], [0.0, 0.0], [1.0, 0.0]]))
    assert f == pytest.approx([2.0, 18.0, 13.0])
    assert (violation > 0.0).tolist() == [True, True, False]
    name = problem.own_parameters[0].name
    assert nlp_gait.solve(problem.with_values(**{name: 6.0})).feasible is False  # the line is above the disk


def test_rows_have_names_bounds_and_scales() -> None:
    problem = by_expressions()
    model = build_exact_model(problem)
    values = model.at([3.0, 3.0], problem.p)
    assert model.row_names[:3] == ("disk", "line", "order")
    assert values.g[:3].tolist() == [13.0, 9.0, 0.0]
    assert values.lower[:3].tolist() == [-np.inf, 1.0, -np.inf] and values.upper[:3].tolist() == [4.0, np.inf, 0.0]
    assert model.row_scales[:2] == pytest.approx([0.4, 0.1])  # a tenth of the bound
    assert problem.variables[0].unit == "m" and problem.objective.unit == "m2"
    moved = model.at([3.0, 3.0], problem.with_values(c=2.0).p)
    assert moved.lower[1] == 2.0


def test_equations_may_be_missed_by_a_tolerance() -> None:
    for tolerance in (0.0, 1e-4):
        x, y = SX.sym("x"), SX.sym("y")
        box = {"x": (-2, 2), "y": (-2, 2)}
        problem = nlp_gait.problem(x + y, [x**2 + y**2 == 1], x=box, tolerance=tolerance)
        values = build_exact_model(problem).at([0.6, 0.8], problem.p)
        assert (values.lower[0], values.upper[0]) == (1 - tolerance, 1 + tolerance)
        least = -np.sqrt(2 * (1 + tolerance))
        assert nlp_gait.solve(problem, starts=3).objective == pytest.approx(least, abs=1e-6)


def test_the_welded_beam_is_loaded_by_name_and_speaks_of_no_gait() -> None:
    beam = nlp_gait.load(BEAM)
    assert (beam.name, beam.moves) == ("beam", False)
    text = beam.describe()
    assert "USD" in text and not [word for word in ("gait", "phase", "sample") if word in text]
    assert nlp_gait.solve(beam, starts=3).objective == pytest.approx(BEST, rel=1e-7)


def test_a_problem_prints_as_one_line_and_describes_itself_as_a_table() -> None:
    for name in ("nao-ssp", "stairs-climb"):
        problem = nlp_gait.load(name)
        assert "\n" not in str(problem) and len(str(problem)) <= 100
    assert str(problem) == "<stairs-climb: minimise effort [1] over 3354 variables, 10 parameters>"
    lines = problem.describe().splitlines()
    assert len(lines) < 80 and "and 3,314 more" in lines
    described = nlp_gait.load("nao-ssp").fix(hip_height_m=0.3).describe()
    assert "hip_height_m" in described and "0.3" in described and "heat_loss_W_per_Nm2" in described


def opti_with_an_integer() -> Any:
    opti = ca.Opti()
    count = opti.variable()
    opti.set_domain(count, "integer")
    opti.minimize((count - 1.5) ** 2)
    opti.subject_to(opti.bounded(0, count, 3))
    return opti


def opti_without_bounds() -> ca.Opti:
    opti = ca.Opti()
    opti.minimize((opti.variable() - 1.5) ** 2)
    return opti


X, Y = SX.sym("x"), SX.sym("y")
BOX = {"x": (0, 1), "y": (0, 1)}


@pytest.mark.parametrize(
    ("arguments", "named", "message"),
    [
        ((X + Y,), {"x": {"x": (0, 1)}}, "give 'y' either bounds, x={'y': .* or a value, p={'y': value}"),
        ((X,), {"x": BOX}, "no expression contains 'y'; they contain x"),
        ((X + Y,), {"x": BOX | {"x": (2, 1)}}, "variable 'x': lower must be below upper, got 2.0 and 1.0"),
        ((X + Y + SX.sym("x"),), {"x": BOX}, "two symbols have the same name 'x'"),
        ((X + Y,), {"x": BOX, "tolerance": -1.0}, "tolerance must be >= 0 and finite, got -1.0"),
        ((X + Y, [True]), {"x": BOX}, "constraint g1 must be a comparison of SX expressions, .*, got True"),
        ((X + Y, [SX(1) <= X / X * 0 + SX.sym("c")]), {"x": BOX, "p": {"c": 1}}, "constraint g1 contains no variable"),
        (({"x": X, "f": X},), {"lbx": [0, 1], "ubx": 1}, "lbx must be one number, got 2"),
        (
            ({"x": X, "f": 3.0},),
            {"lbx": 0, "ubx": 1},
            "f of CasADi's dictionary must be MX or SX as x is, got 3.0",
        ),
        (({"x": X, "p": Y, "f": X},), {"lbx": 0, "ubx": 1}, r"p \(y\) must be one number, got 0"),
        (({"x": X, "f": X * Y},), {"lbx": 0, "ubx": 1}, "f or g contains 'y', which is neither in x nor in p"),
        (({"x": X + 1, "f": X},), {"lbx": 0, "ubx": 1}, "x of CasADi's dictionary must be different symbols, got"),
        (
            ({"x": ca.vertcat(X, X), "f": X},),
            {"lbx": 0, "ubx": 1},
            "x of CasADi's dictionary must be different symbols",
        ),
        ((opti_without_bounds(),), {}, "the Opti stack has no bounds of its variables"),
        ((opti_with_an_integer(),), {}, "is an integer variable; problems here are continuous: relax it"),
    ],
)
def test_what_is_not_allowed_is_one_sentence(arguments: Any, named: dict[str, Any], message: str) -> None:
    with pytest.raises((InputError, UnknownNameError), match=message) as error:
        nlp_gait.problem(*arguments, **named)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["", " ", "a\nb", "$a"])
def test_a_name_that_no_table_can_show_is_refused(name: str) -> None:
    symbol = SX.sym(name)
    with pytest.raises(InputError, match="a name, label or unit must be printable text without '\\$', and not blank"):
        check_mathematics(nlp_gait.problem({"x": symbol, "f": symbol**2}, lbx=0, ubx=1))
