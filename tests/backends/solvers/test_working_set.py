"""IPOPT on the rows that matter: it ends where IPOPT on all rows does, and every row holds there."""

import math
from typing import Any

import casadi as ca
import numpy as np
import pytest
from casadi import MX, vertcat

from nlp_gait.backends.solvers import working_set
from nlp_gait.backends.solvers.ipopt import QUIET, IpoptSettings
from nlp_gait.backends.solvers.solver import INTERRUPTED, IterationWatch
from nlp_gait.backends.solvers.working_set import WorkingSet
from nlp_gait.formulation import load
from nlp_gait.interrupts import never

SIDES = 200
NAMES = ("nlp_f", "nlp_g", "nlp_grad_f", "nlp_jac_g", "nlp_hess_l")


def polygon(
    *, linear: bool = False, always: Any = None, within: float | None = None
) -> tuple[WorkingSet, ca.Function, IterationWatch, dict[str, Any]]:
    """The point of a polygon of many sides about the unit circle that is nearest to (2, 1), or farthest in a direction."""
    x, p = MX.sym("x", 2), MX.sym("p")
    angles = np.linspace(0.0, 2.0 * math.pi, SIDES, endpoint=False)
    f = -x[0] - p * x[1] if linear else (x[0] - 2) ** 2 + p * (x[1] - 1) ** 2 + 0.1 * ca.sin(x[0])
    sign = np.where(np.arange(SIDES) % 2, -1.0, 1.0)  # every second side is a lower bound of -1
    nlp = {"x": x, "p": p, "f": f, "g": ca.DM(sign * np.cos(angles)) * x[0] + ca.DM(sign * np.sin(angles)) * x[1]}
    watch = IterationWatch(nlp)
    whole = ca.nlpsol("whole", "ipopt", nlp, {**QUIET, "iteration_callback": watch})
    functions = {name: whole.get_function(name) for name in NAMES}
    few = WorkingSet(nlp, functions, QUIET, watch, np.zeros(SIDES, dtype=bool) if always is None else always, within)
    inf = np.full(2, np.inf)
    sides = {"lbg": np.where(sign > 0, -np.inf, -1.0), "ubg": np.where(sign > 0, 1.0, np.inf)}
    arguments = {"p": [1.0], "lbx": -inf, "ubx": inf, **sides}
    watch.begin(never, math.inf)
    return few, whole, watch, {**arguments, "x0": np.array([0.1, -0.2])}


def same(found: Any, expected: Any) -> bool:
    """Point and multipliers, to IPOPT's tolerance."""
    pairs = ((np.array(found[key]).ravel(), np.array(expected[key]).ravel()) for key in ("x", "lam_g", "lam_x"))
    return all(np.allclose(a, b, rtol=0.0, atol=1e-6) for a, b in pairs)


def test_rows_that_are_violated_join_until_none_is() -> None:
    few, whole, _, arguments = polygon()
    found = few(**arguments)
    assert same(found, whole(**arguments))
    assert few.stats()["success"] and few.stats()["iter_count"] > whole.stats()["iter_count"]  # of several rounds
    first = few.stats()["iter_count"]
    few.add_violated_rows(**arguments)
    assert same(few(**arguments), whole(**arguments)) and few.stats()["iter_count"] < first  # all in one round
    assert few.stats()["n_call_nlp_hess_l"] <= first
    few, *_, arguments = polygon(within=1.05)  # the start is 1.0 from the side at the end, of 0.8 to 1.2
    assert same(found := few(**arguments), whole(**arguments))
    heights = 1.0 - np.array([0.1, -0.2]) @ [f(np.arange(SIDES) * 2.0 * math.pi / SIDES) for f in (np.cos, np.sin)]
    assert (np.array(found["lam_g"]) != 0.0).tolist() == (heights <= 1.05).tolist()  # all in one round


def test_where_some_rows_are_not_enough_the_run_fails() -> None:
    """Without rows a linear objective has no least value; with two of them it has."""
    few, *_, arguments = polygon(linear=True)
    few(**arguments)
    assert not few.stats()["success"]
    rows = np.zeros(SIDES, dtype=bool)
    rows[[20, 30]] = True
    few, *_, arguments = polygon(linear=True, always=rows)
    found = few(**{**arguments, "p": [1.02]})
    corner = np.array([math.cos(25.5 * 2 * math.pi / SIDES), math.sin(25.5 * 2 * math.pi / SIDES)])
    assert few.stats()["success"]
    assert np.array(found["x"]).ravel() == pytest.approx(corner / math.cos(math.pi / SIDES), abs=1e-6)
    assert np.flatnonzero(np.abs(found["lam_g"]) > 1e-3).tolist() == [25, 26]


def test_rows_that_still_join_in_the_last_round_are_no_success(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(working_set, "ROUNDS", 1)
    few, *_, arguments = polygon()
    few(**arguments)
    assert not few.stats()["success"] and few.stats()["return_status"] == working_set.UNSETTLED


def test_a_run_that_is_ended_is_not_begun_again() -> None:
    few, _, watch, arguments = polygon()
    watch.begin(lambda: True, math.inf)
    found = few(**arguments)
    assert watch.reason == INTERRUPTED and not few.stats()["success"] and few.stats()["iter_count"] <= 1
    assert np.array(found["lam_g"]).ravel().shape == (SIDES,)


@pytest.mark.parametrize("compiled", [True, False])
def test_a_gait_has_few_rows_that_matter(compiled: bool) -> None:
    """Its start does not depend on the copy of the problem that was solved first, and no limit is broken in the end."""
    problem = load("nao-dsp", intervals=5)
    x0 = problem.start_point(np.random.default_rng(5))
    settings = IpoptSettings(compiled=compiled, few_rows=True)
    found = settings.prepare(problem).run(problem, x0)
    assert found.converged and found.violation == pytest.approx(0.0, abs=1e-8)
    assert found.objective == pytest.approx(0.53867071, rel=1e-7)  # as on all rows
    other = load("nao-dsp", intervals=np.int64(5))  # not the same object
    settings.prepare(other).run(other.with_values(torque_change_limit_Nm=5.0), x0)
    assert settings.prepare(other).run(other, x0).x.tolist() == found.x.tolist()


def test_a_row_that_is_violated_a_little_joins() -> None:
    """The greatest x below two limits that differ by 5e-4, of which the run begins with the higher one."""
    x, p = MX.sym("x"), MX.sym("p")
    nlp = {"x": x, "p": p, "f": -p * x, "g": vertcat(x, x)}
    watch = IterationWatch(nlp)
    whole = ca.nlpsol("whole", "ipopt", nlp, {**QUIET, "iteration_callback": watch})
    functions = {name: whole.get_function(name) for name in NAMES}
    few = WorkingSet(nlp, functions, QUIET, watch, np.array([True, False]))
    watch.begin(never, math.inf)
    limits = {"lbx": [-9.0], "ubx": [9.0], "lbg": np.full(2, -np.inf), "ubg": np.array([1.0, 0.9995])}
    found = few(p=1.0, x0=0.0, **limits)
    assert few.stats()["success"] and float(found["x"]) == pytest.approx(0.9995, abs=1e-7)
    assert found["lam_g"] == pytest.approx([0.0, 1.0], abs=1e-5)
