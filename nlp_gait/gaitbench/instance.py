"""Instances of the suite: each one object with everything that an optimiser needs, and how the best known point is found."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import asdict
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from nlp_gait.backends.exact import ExactModel, build_exact_model, hash_json, identify_problem, make_key
from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
from nlp_gait.backends.kernel.compiler import find_cache_folder
from nlp_gait.backends.solve import solve
from nlp_gait.decoding import read_dataclass
from nlp_gait.errors import InputError, check_name
from nlp_gait.files import make_writable_folder, replace_nan, write_json
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaitbench.adapters import find_adapter
from nlp_gait.gaitbench.facts import Evidence, Facts, find_shipped_facts
from nlp_gait.gaitbench.generated import STARTS, define, gaitbench, is_generated, make_id, parse_id

SAME = 1e-6  # relative difference of two results of IPOPT that count as equal
# Slack of the best known point in every row, in units of its scale: no machine's rounding makes it infeasible.
SLACK = 1e-10
MOST_ROUNDS = 4  # of the starts, until one of them converges

_BUILDING = threading.RLock()  # compiled functions are shared by all threads, and built by one of them


class OneSidedRows:
    """The m rows of a problem as one-sided rows, G <= 0 in units of each row's scale, without the variables' bounds."""

    def __init__(self, model: ExactModel, problem: GaitProblem) -> None:
        lower, upper = model.row_bounds(problem)
        rows = len(lower) - len(problem.names)
        both = np.stack([lower[:rows], upper[:rows]], axis=1)
        self.row, side = (np.asarray(indexes) for indexes in np.nonzero(np.isfinite(both)))  # (m,) rows of the kernel
        self.sign = np.where(side == 1, 1.0, -1.0)  # (m,) +1 for an upper bound
        self.bound = both[self.row, side]  # (m,) [unit of the row]
        self.weight = 1.0 / model.row_scales[self.row]  # (m,) 1 / scale
        self.groups = tuple(model.row_groups[r] for r in self.row)  # (m,) names of the constraints
        words = (">= lower", "<= upper")
        # (m,) for example ``torque_change[LKneePitch, 3] <= upper``
        self.names = tuple(f"{model.row_names[r]} {words[s]}" for r, s in zip(self.row, side, strict=True))

    def __call__(self, g: Array) -> Array:
        """Return the one-sided rows (P, m) of the kernel's rows (P, ...)."""
        return np.asarray(self.sign * (g[:, self.row] - self.bound) * self.weight)


class Instance:
    """A frozen problem: minimise f(x) within bounds, subject to rows G(x) <= 0.

        f, violation = problem(X)

    It is picklable, and may be called from several threads and processes at once.
    """

    def __init__(self, id: str) -> None:
        """Use ``gaitbench.load`` instead."""
        self.id = id  #: its name, which never changes
        self.definition = define(id)  #: what it is made from
        self.gait_problem: GaitProblem = gaitbench(instance=id)
        self.names = self.gait_problem.names  #: (n,) variables
        self.units = tuple(variable.unit for variable in self.gait_problem.variables)  #: (n,) of the variables
        self.lower = self.gait_problem.lower  #: (n,) bounds
        self.upper = self.gait_problem.upper  #: (n,) bounds

    def __reduce__(self) -> tuple[Any, ...]:
        return load, (self.id,)

    def __repr__(self) -> str:
        return f"<GaitBench {self.id}: {len(self.names)} variables, {len(self.row_names)} inequalities>"

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Evaluate points X (P, n), one a row; raises InputError if X has another shape, or is not made of numbers.

        Returns:
            (P,) objective, to be minimised; and (P,) violation: the sum of all rows' positive parts and of what exceeds the
            bounds, in units of each scale, zero if and only if the point is feasible. Both are infinite where x is not finite.
        """
        return self._objective(X)

    def objective(self, x: Array | Sequence[float]) -> float:
        """Return the objective at one point x (n,), to be minimised."""
        return self._objective.point(x)[0]

    def violation(self, x: Array | Sequence[float]) -> float:
        """Return the total violation at one point x (n,): zero if and only if it is feasible."""
        return self._objective.point(x)[1]

    def rows(self, X: Array) -> Array:
        """Return the rows G(X) (P, m), satisfied where <= 0, in units of each row's scale; ``row_names`` has their names."""
        return self.sides(self._objective.constraints(X))

    def gradient(self, x: Array) -> Array:
        """Return the gradient (n,) of the objective at x (n,); at a kink, a one-sided one."""
        gradient, _ = self._derivatives(self._point(x), self.gait_problem.p)
        return np.array(gradient).ravel()

    def jacobian(self, x: Array) -> Array:
        """Return the derivatives (m, n) of the rows at x (n,); at a kink, one-sided ones."""
        _, jacobian = self._derivatives(self._point(x), self.gait_problem.p)
        sides = self.sides
        return np.array(jacobian)[sides.row] * (sides.sign * sides.weight)[:, None]

    @property
    def row_names(self) -> tuple[str, ...]:
        """(m,) names of the rows."""
        return self.sides.names

    @cached_property
    def facts(self) -> Facts:
        """Best known point, its evidence, and what was measured; of a generated instance computed on first use, and stored."""
        return find_facts(load(self.id))

    @property
    def best_known(self) -> float:
        """Least feasible objective known, in the sense of minimisation."""
        return self.facts.best_known

    @property
    def best_x(self) -> Array:
        """(n,) point of the best known objective."""
        return np.array(self.facts.best_x)

    @property
    def evidence(self) -> Evidence:
        """Why the best known objective may be the optimum; ``str()`` says it in words."""
        return self.facts.evidence

    def to(self, adapter: str, **options: Any) -> Any:
        """Return the instance in the form that an optimiser's package takes, with options of that adapter.

        - ``scipy``: arguments of ``scipy.optimize.minimize`` (fun, jac, bounds, constraints)
        - ``cma``: arguments of ``cma.fmin_con2``; a constraint is the worst row of a group of rows
        - ``ioh``: problem with the optimum; the total violation is a soft constraint, which adds to the objective
        - ``pymoo``: vectorised problem; G is the total violation, or every row with ``rows=True``

        Raises UnknownNameError, or MissingExtraError without the package.
        """
        return find_adapter(adapter)(self, **options)

    @cached_property
    def _objective(self) -> CompiledObjective:
        with _BUILDING:
            return compile_objective(self.gait_problem)

    @cached_property
    def sides(self) -> OneSidedRows:
        """Which one-sided rows the kernel's rows make."""
        with _BUILDING:
            return OneSidedRows(build_exact_model(self.gait_problem), self.gait_problem)

    @cached_property
    def _derivatives(self) -> ca.Function:
        with _BUILDING:
            return self.gait_problem.build_once(_build_derivatives)

    def _point(self, x: Array) -> Array:
        array = np.asarray(x, dtype=float)
        if array.shape != (len(self.names),):
            raise InputError(f"x of {self.id} must have {len(self.names)} values, got shape {array.shape}")
        return array


def load(id: str) -> Instance:
    """Load an instance by its id; raises UnknownNameError."""
    check_name("instance", id)
    return _load(id)


def generate(family: str, seed: int) -> Instance:
    """Draw an instance of GaitBench 2 from a family; the same seed gives the same one on every machine.

    Args:
        family: one of ``list_families()``.
        seed: 0 or above.

    Raises UnknownNameError, or InputError if the seed is not a whole number from 0 to 1e12.
    """
    return load(make_id(family, seed))


@lru_cache(maxsize=128)
def _load(id: str) -> Instance:
    with _BUILDING:
        return Instance(id)


def _build_derivatives(problem: GaitProblem) -> ca.Function:
    x, p = ca.MX.sym("x", len(problem.names)), ca.MX.sym("p", len(problem.parameters))
    cost, g = build_exact_model(problem).kernel(x, p)
    rows = g[: g.shape[0] - len(problem.names)]
    return ca.Function("derivatives", [x, p], [ca.gradient(cost, x), ca.densify(ca.jacobian(rows, x))])


def find_facts(instance: Instance) -> Facts:
    """Return the facts about an instance: shipped ones, or those of this call or of an earlier one on this machine.

    Raises InputError if no start of IPOPT converged, so that the instance has no best known point.
    """
    if (shipped := find_shipped_facts(instance.id)) is not None:
        return shipped
    digest = hash_json(make_key(identify_problem(instance.gait_problem)))
    path = find_cache_folder() / "gaitbench" / f"{instance.id.replace(':', '-')}-{digest[:16]}.json"
    try:
        return read_dataclass(Facts, path, "stored best known point", error=InputError)
    except InputError:
        facts = compute_facts(instance, parse_id(instance.id)[0].starts if is_generated(instance.id) else STARTS)
    make_writable_folder(path.parent)
    write_json(path, replace_nan(asdict(facts)))
    return facts


def compute_facts(instance: Instance, starts: int) -> Facts:
    """Return the best point of IPOPT from random starts and its evidence; raises InputError if no start converges."""
    problem = instance.gait_problem
    for seed in range(MOST_ROUNDS):
        ends = [outcome for outcome in solve(problem, starts=starts, seed=seed, workers=1).starts if outcome.converged]
        for end in sorted(ends, key=lambda outcome: outcome.cost):
            best = make_strictly_feasible(instance, np.array(end.x))
            if best is None:
                continue
            best_known = evaluate_interpreted(instance, best)[0]
            costs = [outcome.cost for outcome in ends]
            return Facts(
                best_known=best_known,
                best_x=tuple(best.tolist()),
                evidence=Evidence(
                    starts=starts * (seed + 1),
                    agreeing=sum(abs(c - best_known) <= SAME * abs(best_known) for c in costs),
                ),
            )
    raise InputError(
        f"{instance.id}: none of {starts * MOST_ROUNDS} starts of IPOPT converged to a feasible point; choose another seed"
    )


def evaluate_interpreted(instance: Instance, x: Array) -> tuple[float, Array]:
    """Return cost and rows (m,) at x (n,) without compiling anything."""
    values = build_exact_model(instance.gait_problem).at(x, instance.gait_problem.p)
    return values.cost, instance.sides(values.g[None])[0]


def make_strictly_feasible(instance: Instance, x: Array) -> Array | None:
    """Return the nearest point with a slack in every row, by linear programs with the smallest possible step, or None.

    IPOPT may leave a row violated by about 1e-8; the best known point has a violation of exactly zero. The programs ignore the
    objective: where it is the largest of several functions, its gradient is that of one of them.
    """
    from scipy.optimize import linprog

    width = instance.upper - instance.lower
    first = np.clip(x, instance.lower, instance.upper)
    n, ends = len(width), list[tuple[float, Array]]()
    for radius in (1e-8, 1e-7, 1e-6, 1e-5, 1e-4):
        x = first
        for _ in range(4):
            cost, G = evaluate_interpreted(instance, x)
            if G.max() <= -SLACK / 2:
                ends.append((cost, x))
                break
            J = instance.jacobian(x) * width
            near = np.abs(J).sum(axis=1) * radius + G > -SLACK
            low, high = (instance.lower - x) / width / radius, (instance.upper - x) / width / radius
            bounds = [*zip(np.maximum(low, -1.0), np.minimum(high, 1.0), strict=True), (0.0, 1.0)]
            least = np.hstack([np.vstack([np.eye(n), -np.eye(n)]), -np.ones((2 * n, 1))])  # |step| <= its largest part
            step = linprog(
                np.eye(n + 1)[-1],
                A_ub=np.vstack([np.hstack([J[near], np.zeros((int(near.sum()), 1))]), least]),
                b_ub=np.concatenate([-(G[near] + SLACK) / radius, np.zeros(2 * n)]),
                bounds=bounds,
            )
            if step.x is None:
                break
            x = np.clip(x + radius * width * step.x[:n], instance.lower, instance.upper)
    return min(ends, key=lambda item: item[0])[1] if ends else None
