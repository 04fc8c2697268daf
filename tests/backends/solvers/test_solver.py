"""A run that exceeds its time limit ends there, says so and keeps its point; a solver that cannot heed a limit is refused one."""

import time

import casadi as ca
import numpy as np
import pytest
from threadpoolctl import threadpool_info

import nlp_gait
from compare.study.run import ProblemSpec
from nlp_gait.backends.solvers import solver as solver_module
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import CasadiBlas, IterationWatch, WatchedSolver
from nlp_gait.errors import InputError

WALK = ProblemSpec(name="walk12")


def slow_iterations(monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
    eval_ = IterationWatch.eval

    def slow(watch: IterationWatch, iterate: object) -> list[int]:
        time.sleep(seconds)
        return eval_(watch, iterate)

    monkeypatch.setattr(IterationWatch, "eval", slow)


def test_ipopt_says_so_and_keeps_where_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use a clock that advances by a second each time it is read."""
    problem = nlp_gait.load("walk12")
    nlp_gait.solve(problem)  # what is built is built
    clock = iter(range(10_000))
    monkeypatch.setattr(solver_module.time, "perf_counter", lambda: float(next(clock)))
    solution = nlp_gait.solve(problem, solver=IpoptSettings(time_limit_s=4.0))
    assert not solution.converged and "stopped at the time limit" in solution.status
    assert 1 <= solution.best.iterations <= 4
    x = np.array(list(solution.x.values()))
    assert (x >= problem.lower).all() and (x <= problem.upper).all() and np.isfinite(solution.objective)


def test_linear_algebra_of_ipopt_has_one_thread_whatever_the_process_has() -> None:
    """With another number the start at seed 7 of nao-ssp takes 1,146 evaluations instead of 1,061: MUMPS rounds differently."""
    nlp_gait.solve(nlp_gait.load("walk12"))
    threads = {library["internal_api"]: library["num_threads"] for library in threadpool_info()}
    assert threads[CasadiBlas.internal_api] == 1


class Stuck(ca.Callback):
    """Zero; from the twentieth call on it takes a minute, like a factorisation that runs out of memory again and again."""

    def __init__(self) -> None:
        ca.Callback.__init__(self)
        self.calls = 0
        self.construct("stuck")

    def eval(self, _: object) -> list[float]:
        self.calls += 1
        time.sleep(0.0 if self.calls < 20 else 60.0)
        return [0.0]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, *_: object) -> ca.Function:
        x, y = ca.MX.sym("x"), ca.MX.sym("y")
        return ca.Function(name, [x, y], [ca.MX(1, 1)])


@pytest.mark.parametrize("presses", [False, True])
def test_an_iteration_of_a_large_problem_that_does_not_end_is_killed(presses: bool) -> None:
    """At the limit and a grace, or at Ctrl-C; the last iterate remains."""
    x, stuck = ca.MX.sym("x", solver_module.MANY_VARIABLES), Stuck()
    nlp = {"x": x, "f": ca.sumsqr((x - 1) ** 2) + stuck(x[0]), "p": ca.MX.sym("p"), "g": x[0]}
    watch = IterationWatch(nlp)
    options = {"ipopt.hessian_approximation": "limited-memory", "ipopt.print_level": 0, "print_time": False}
    solver = WatchedSolver(ca.nlpsol("solver", "ipopt", nlp, {**options, "iteration_callback": watch}), watch)
    started = time.perf_counter()
    watch.begin(lambda: presses and time.perf_counter() > started + 1.0, started + (60.0 if presses else 4.0))
    start = np.zeros(solver_module.MANY_VARIABLES)
    result = solver(x0=start, p=0.0, lbx=start - 9.0, ubx=start + 9.0, lbg=[-9.0], ubg=[9.0])
    assert time.perf_counter() - started < 14.0 + solver_module.GRACE_S
    assert watch.reason == ("Interrupted" if presses else "Killed") and not solver.stats()["success"]
    assert result["x"].min() > 0.0  # it has moved


def test_a_missing_linear_solver_is_reported_and_never_replaced() -> None:
    problem = nlp_gait.load("walk12")
    for name in ("ma57", "mumps"):
        try:
            solution = nlp_gait.solve(problem, solver=IpoptSettings(linear_solver=name))
        except InputError as error:
            assert name == "ma57"
            assert "linear solver 'ma57' does not run in this installation" in str(error)
            assert "leave linear_solver out for " in str(error)
        else:
            assert solution.best.linear_solver.lower() == name
    with pytest.raises(InputError, match="linear_solver must be one of None, 'ma27', .*, got 'ma'"):
        IpoptSettings(linear_solver="ma")
