"""Compiled functions and derivatives of an NLP: CasADi's values, and the same path of a solver."""

import casadi as ca
import numpy as np
import pytest
from casadi import DM, MX, SX

import nlp_gait
from nlp_gait.backends.derivatives import structure
from nlp_gait.backends.derivatives.assembly import make_nlp_plan
from nlp_gait.backends.derivatives.compiled import CompiledNlp
from nlp_gait.backends.derivatives.structure import split_nlp
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.errors import CompilerError
from nlp_gait.formulation import Array

OPTIONS = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
X, P = MX.sym("x", 2), MX.sym("p")
ROSENBROCK = {"x": X, "p": P, "f": (1 - X[0]) ** 2 + P * (X[1] - X[0] ** 2) ** 2, "g": ca.sumsqr(X)}
# Rounding of sums in another order, relative to the largest number of a result.
TOLERANCE = 1e-12


def chain() -> dict[str, MX]:
    """Two functions that are mapped, one after the other, and glue that is not linear between and behind them."""
    x, p, samples = MX.sym("x", 3 + 5), MX.sym("p", 2), 5
    u, phase = SX.sym("u", 3), SX.sym("phase")
    bent = ca.vertcat(ca.sin(u[0] * phase) * u[1], ca.atan2(u[2], 1 + u[0] ** 2), ca.fmax(u[1], 0.1) ** 2, phase)
    first = ca.Function("first", [u, phase], [bent, ca.sqrt(1 + u[1] ** 2)])
    v, own = SX.sym("v", 4), SX.sym("own", 2)
    second = ca.Function(
        "second", [v, own], [ca.exp(-v[0] * own[0]) + v[1] * own[1] ** 3, ca.if_else(v[2] > 0.2, v[0], 2.0)]
    )
    bends, root = first.map(samples)(ca.repmat(x[:3] / p[0], 1, samples), DM(np.linspace(0.2, 1.0, samples)).T)
    rates = (bends[:, 1:] - bends[:, :-1]) * (samples / x[0])
    lifted = ca.horzcat(x[3:7], x[4:8]).T
    found, jump = second.map(samples - 1)(rates * ca.repmat(root[:, 1:], 4, 1), lifted)
    g = ca.vertcat(found.T - x[3:7] * p[1], jump.T, ca.vec(bends), x[3] * x[4])
    return {"x": x, "p": p, "f": ca.sumsqr(found) / x[0] + ca.sum2(root) + ca.tanh(x[7]), "g": g}


def compared(nlp: dict[str, MX], p: Array, points: Array) -> float:
    """Largest difference of all functions from CasADi's, relative to the largest number of the result."""
    compiled = CompiledNlp(nlp, p).functions
    usual = ca.nlpsol("usual", "ipopt", nlp, OPTIONS)
    worst, rng = 0.0, np.random.default_rng(1)
    for w in points:
        for name, function in compiled.items():
            weights = (1.3, rng.normal(size=nlp["g"].shape[0])) if name == "nlp_hess_l" else ()
            given = [DM(each) for each in (w, p, *weights)]
            for ours, theirs in zip(function.call(given), usual.get_function(name).call(given), strict=True):
                assert np.isfinite(ours.full()).all()
                apart = np.abs((ours - theirs).full()).max(initial=0.0)
                worst = max(worst, apart / max(1e-9, np.abs(theirs.full()).max(initial=0.0)))
    return worst


@pytest.mark.parametrize("longest", [0, structure.LONGEST_WRITTEN_OUT], ids=["in directions", "written out"])
def test_chained_samples_give_the_same_values_and_derivatives(longest: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(structure, "LONGEST_WRITTEN_OUT", longest)
    monkeypatch.setattr("nlp_gait.backends.derivatives.compiled._hash_generator", lambda: f"longest {longest}")
    points = np.random.default_rng(0).uniform(0.4, 1.5, (20, 8))
    assert compared(chain(), np.array([1.1, 0.7]), points) < TOLERANCE


def test_single_support_gives_the_same_values_and_derivatives_also_outside_the_bounds() -> None:
    problem = nlp_gait.load("nao-ssp")
    model = build_nlp(problem)
    rng, n = np.random.default_rng(0), model.variables
    starts = [model.start(problem, model.point(rng.uniform(-0.5, 1.5, n)), model.widths[0]) for _ in range(5)]
    points = np.array([w + np.append(np.zeros(n), rng.normal(0.0, 0.1, len(w) - n)) for w in starts])
    assert compared(model.nlp, np.append(problem.p, model.widths[0]), points) < 1e-10


def test_a_solver_of_compiled_functions_takes_the_same_path() -> None:
    interpreted = ca.nlpsol("interpreted", "ipopt", ROSENBROCK, OPTIONS)
    native = CompiledNlp(ROSENBROCK, np.array([90.0]))
    compiled = ca.nlpsol("compiled", "ipopt", native.nlp, {**OPTIONS, **native.options})
    ends = [solver(x0=[-1.0, 1.0], p=100.0, ubg=1.0) for solver in (interpreted, compiled)]
    assert np.array(ends[0]["x"]) == pytest.approx(np.array(ends[1]["x"]), rel=1e-9)
    assert interpreted.stats()["iter_count"] == compiled.stats()["iter_count"] > 3


def test_a_hessian_of_zero_is_compiled_too() -> None:
    x, p = MX.sym("x", 2), MX.sym("p", 1)
    nlp = {"x": x, "p": p, "f": 2 * x[0] - p * x[1], "g": x[0] + 3 * x[1]}
    assert compared(nlp, np.array([1.5]), np.array([[0.3, 0.4], [2.0, -1.0]])) < TOLERANCE
    assert CompiledNlp(nlp, np.array([1.5])).functions["nlp_hess_l"].nnz_out() == 0


def test_an_nlp_that_cannot_be_split_is_refused() -> None:
    x, table = MX.sym("x", 2), ca.interpolant("table", "linear", [[0.0, 1.0, 2.0]], [0.0, 1.0, 4.0])
    with pytest.raises(CompilerError):
        make_nlp_plan(split_nlp({"x": x, "p": MX(0, 1), "f": table(x[0]), "g": x}))
