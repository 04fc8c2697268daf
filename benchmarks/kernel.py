"""Rows about the kernel and searches on it: against CasADi, NumPy with Pinocchio, and pymoo's PSO."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from casadi import MX, SX, Function, vertcat, vertsplit
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.problem import Problem
from pymoo.optimize import minimize as pymoo_minimize

import nlp_gait
from benchmarks.by_hand import ARM_SWING, ByHand, pinocchio_model
from benchmarks.casadi_code import compiled_functions
from benchmarks.rows import Array, Row, ratio, side_by_side
from metaheuristics import ParticleSwarm, minimize
from metaheuristics.interface import BatchObjective
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import SHARED, NativeRows
from nlp_gait.backends.kernel.compiler import find_compiler, native_lanes, write_rows_source
from nlp_gait.formulation import GaitProblem
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.nao.body import HELD_ARM_ANGLES, JOINTS, PLANNED_JOINTS, make_nao
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.dynamics import newton_euler
from nlp_gait.symbolic.tape import simplify

BATCH = 1000
EVALUATIONS, POPULATION = 10_000, 50
SLOW_PART = 20  # the slowest search runs this part of the generations


def candidates(problem: GaitProblem, count: int) -> Array:
    """Uniform within the bounds, always the same."""
    return np.random.default_rng(0).uniform(problem.lower, problem.upper, (count, len(problem.names)))


def paths(rounds: int) -> list[Row]:
    """The objective with its violation by every path, one core, batch 1000."""
    problem = nlp_gait.load("nao-ssp")
    X = candidates(problem, BATCH)
    objective = nlp_gait.compile_objective(problem, require_compiler=True)
    scalar = nlp_gait.compile_objective(problem, require_compiler=True, lanes=1)
    by_hand = ByHand()
    machine = _with_violation(problem)
    share = 20  # the slow paths get a part of the batch
    few = X[: BATCH // share]
    columns, parameters = few.T.copy(), np.repeat(problem.p[:, None], len(few), axis=1)
    interpreted = machine.map(len(few))
    (generated,) = compiled_functions([machine])
    compiled = generated.map(len(few))
    times = side_by_side(
        {
            "kernel": lambda: objective(X),
            "scalar": lambda: scalar(X),
            "machine": lambda: interpreted(columns, parameters),
            "external": lambda: compiled(columns, parameters),
            "by hand": lambda: by_hand(few),
        },
        rounds,
    )
    lanes = native_lanes()
    measured = float(np.median(times["kernel"])) / BATCH
    return [
        Row(
            name="kernel, a candidate", value=measured * 1e6, unit="us", note=f"{lanes} lanes, batch {BATCH}, one core"
        ),
        Row(
            name="against CasADi's virtual machine",
            value=ratio(times["machine"], times["kernel"], share),
            unit="x",
            required=50,
        ),
        Row(
            name="against CasADi's C code, external with map",
            value=ratio(times["external"], times["kernel"], share),
            unit="x",
            note="scalar, -O1, mapped serially",
        ),
        Row(name="against the same code with one lane", value=ratio(times["scalar"], times["kernel"]), unit="x"),
        Row(
            name="against NumPy and Pinocchio",
            value=ratio(times["by hand"], times["kernel"], share),
            unit="x",
            required=100,
            note="pin.rnea sample by sample, the rest vectorised over samples",
        ),
    ]


def _with_violation(problem: GaitProblem) -> Function:
    """Cost and violation as one CasADi function of (x, p), without what does not belong to them."""
    x, p = MX.sym("x", len(problem.names)), MX.sym("p", len(problem.p))
    cost, violation, *_ = build_exact_model(problem).function.call([x, p], True, False)
    return Function("with_violation", [x, p], [cost, violation])


def torques(rounds: int) -> list[Row]:
    """Inverse dynamics alone, samples one by one: every joint free, and as the gait moves them."""
    body = make_nao("nao-v5")
    moving = [name for name in JOINTS if name in PLANNED_JOINTS or name in ARM_SWING]
    free = _torques(rounds, body, JOINTS, ())
    gait = _torques(rounds, body, moving, body.upright)
    return [
        Row(name="torques alone, against pin.rneaInParallel(1)", unit="x", required=12, **gait),
        Row(name="torques alone, all 22 joints free", unit="x", **free),
    ]


def _torques(rounds: int, body: Body, moving: Sequence[str], upright: Collection[str]) -> dict[str, Any]:
    """Ratio and note: kernel of the torques of all joints from the state of those that move, against Pinocchio."""
    count, n, robot = 11 * BATCH, len(moving), body.robot
    state = SX.sym("state", 3 * n)
    parts = [dict(zip(moving, part.elements(), strict=True)) for part in vertsplit(state, n)]
    held = {name: SX(HELD_ARM_ANGLES.get(name, 0.0)) for name in JOINTS}
    still = dict.fromkeys(JOINTS, SX(0))
    tree = make_tree(robot, robot.feet["left"].link)
    torque, _ = newton_euler(
        tree, held | parts[0], still | parts[1], still | parts[2], body.gravity_vector, upright=upright
    )
    outputs = simplify([vertcat(*(torque[name] for name in JOINTS))])
    function = Function("kernel", [state, SX.sym("p", 0)], [SX(0), *outputs])
    native = NativeRows(write_rows_source(function, objective=True), find_compiler(), native_lanes())

    states = np.random.default_rng(0).uniform(-1.0, 1.0, (count, 3, n))
    if upright:  # legs whose joints keep torso and soles level
        place = {name: i for i, name in enumerate(moving)}
        for side in "LR":
            roll, pitch, knee = (place[f"{side}{name}"] for name in ("HipRoll", "HipPitch", "KneePitch"))
            states[:, :, place[f"{side}AnkleRoll"]] = -states[:, :, roll]
            states[:, :, place[f"{side}AnklePitch"]] = -(states[:, :, pitch] + states[:, :, knee])
    rows = states.reshape(count, 3 * n)
    f, violation, g, limit = np.empty(count), np.empty(count), np.empty((count, 22)), np.full(22, np.inf)

    model, places = pinocchio_model(robot)
    pool = pin.ModelPool(model, 1)
    full = np.zeros((3, 22, count))
    full[0] = np.array([float(held[name]) for name in JOINTS])[:, None]
    full[:, [JOINTS.index(name) for name in moving]] = states.transpose(1, 2, 0)
    ordered = np.empty_like(full)
    ordered[:, places] = full
    arrays = [np.asfortranarray(part) for part in ordered]
    result = np.empty((22, count), order="F")
    times = side_by_side(
        {
            "kernel": lambda: native(
                (rows, np.empty(0), -limit, limit, np.zeros(22)), SHARED, (f, g, violation), count
            ),
            "pinocchio": lambda: pin.rneaInParallel(1, pool, *arrays, result),
        },
        rounds,
    )
    ours, theirs = (float(np.median(times[name])) / count * 1e9 for name in ("kernel", "pinocchio"))
    error = np.abs(g - result[places].T).max()
    note = f"{n} joints move: {ours:.0f} ns a sample against {theirs:.0f} ns; largest difference {error:.0e} Nm"
    return {"value": ratio(times["pinocchio"], times["kernel"]), "note": note}


def growth(rounds: int) -> list[Row]:
    """Cost by samples and batch size."""
    rows, last = [], {}
    objectives = {
        intervals + 1: nlp_gait.compile_objective(nlp_gait.load("nao-ssp", intervals=intervals))
        for intervals in (10, 40, 100, 1000)
    }
    X = candidates(objectives[11].problem, 200)
    times = side_by_side({str(n): (lambda o=o: o(X)) for n, o in objectives.items()}, rounds)
    for n in (41, 101, 1001):
        limits = {"required": 9.5, "at_most": True} if n == 101 else {}
        rows.append(Row(name=f"{n} samples against 11", value=ratio(times[str(n)], times["11"]), unit="x", **limits))
    objective = objectives[11]
    for count in (1, 10, 50, 1000, 10_000, 100_000):
        X = candidates(objective.problem, count)
        last = side_by_side({"kernel": lambda X=X: objective(X)}, 3 if count > 1000 else rounds)
        rows.append(Row(name=f"batch {count}, a candidate", value=np.median(last["kernel"]) / count * 1e6, unit="us"))
    return rows


class PymooProblem(Problem):
    """A batch objective as pymoo wants it."""

    def __init__(self, objective: BatchObjective) -> None:
        super().__init__(n_var=len(objective.lower), n_obj=1, n_ieq_constr=1, xl=objective.lower, xu=objective.upper)
        self.objective = objective

    def _evaluate(self, X: np.ndarray, out: dict[str, np.ndarray], *_: object, **__: object) -> None:
        out["F"], out["G"] = (values[:, None] for values in self.objective(X))


def swarms(rounds: int) -> list[Row]:
    """Our PSO against pymoo's: 50 particles, 200 generations, on the kernel and on NumPy with Pinocchio."""
    objective = nlp_gait.compile_objective(nlp_gait.load("nao-ssp"), require_compiler=True)
    fast, slow = PymooProblem(objective), PymooProblem(ByHand())
    generations = EVALUATIONS // POPULATION

    def pymoo(target: Problem, count: int) -> object:
        return pymoo_minimize(target, PSO(pop_size=POPULATION), ("n_gen", count), seed=0, verbose=False)

    times = side_by_side(
        {
            "ours": lambda: minimize(objective, ParticleSwarm(), evaluations=EVALUATIONS, seed=0),
            "pymoo": lambda: pymoo(fast, generations),
            "pymoo by hand": lambda: pymoo(slow, generations // SLOW_PART),
        },
        rounds,
    )
    same = ratio(times["pymoo"], times["ours"])
    by_hand = ratio(times["pymoo by hand"], times["ours"], SLOW_PART)
    note = f"extrapolated from {generations // SLOW_PART} generations"
    return [
        Row(name="PSO 50 x 200", value=float(np.median(times["ours"])) * 1e3, unit="ms"),
        Row(name="PSO against pymoo's on the same kernel", value=same, unit="x", required=15),
        Row(name="PSO against pymoo's on NumPy and Pinocchio", value=by_hand, unit="x", note=note),
    ]
