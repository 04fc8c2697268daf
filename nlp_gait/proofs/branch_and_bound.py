"""Branch and bound with rigorous bounds: a limit on the objective of every feasible x.

A box is dropped if bounds of its rows prove that it contains no feasible point, or bounds of its cost that no point in it is
better than the incumbent by more than the tolerance; slabs of which this is true are cut off. The rest is halved, the box with
the best bound first. The result of a box depends on that box alone, so that ``certificate.py`` can follow any path from the root
to a dropped box.

Source:
    Hansen, Walster (2004), Global Optimization Using Interval Analysis; Moore, Kearfott, Cloud (2009), chapter 6.
"""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nlp_gait.backends.exact import build_exact_model, hash_json, identify_problem, make_key
from nlp_gait.errors import InputError
from nlp_gait.files import read_bytes, replace_file
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.interrupts import Progress, ignore_progress
from nlp_gait.proofs.affine import Numbers
from nlp_gait.proofs.bounds import Bounds, make_bounds
from nlp_gait.proofs.certificate import PROVER, Certificate

# Number of boxes that are halved together, at least: this, or one in SHARE of the open ones, so that sorting costs little.
BATCH, SHARE = 1024, 8
CHECKPOINT_S = 30.0
HASH_SIZE, LARGEST_CHECKPOINT = 32, 2**31  # bytes; ten million open boxes of nine variables
TOLERANCE = 1e-6  # six digits


@dataclass
class Tree:
    """Open boxes (P, n, 2), each with a lower bound of its cost, the next cut and its depth; and the work so far."""

    boxes: Array
    lowest: Array
    cut: Numbers
    depth: Array
    enclosed: int = 1
    time_s: float = 0.0
    cpu_s: float = 0.0

    def find_bound(self, target: float) -> float:
        """Return the lower bound of the cost that is proven: that of the open boxes, at most the target."""
        return float(self.lowest.min(initial=target))

    def estimate_share_left(self) -> float:
        """Return the open share of the tree, as if both halves of a box were equal work."""
        return float(np.exp2(-self.depth.astype(float)).sum())


def certify(
    problem: GaitProblem,
    incumbent: Array,
    *,
    tolerance: float = TOLERANCE,
    time_limit_s: float = 300.0,
    progress: Progress = ignore_progress,
    checkpoint: Path | None = None,
) -> Certificate:
    """Prove a bound on the optimum within the variables' bounds.

    Args:
        problem: with few variables, because the work grows exponentially with their number.
        incumbent: (n,) the best known feasible point.
        tolerance: relative distance of bound and objective at which to stop.
        time_limit_s: wall time after which the bound so far is returned [s].
        progress: receives the number of boxes, the bound in the problem's sense, and the share of the tree that is left.
        checkpoint: file with the open boxes, written every half minute and at the end; a killed proof continues from it.

    Raises:
        InputError: the incumbent is not feasible, tolerance or time limit are not positive, or the checkpoint is damaged or
            of another problem, incumbent, tolerance or version of the prover.
        CompilerError: there is no compiler, or it fails.
    """
    if not (0.0 < tolerance < 1.0 and time_limit_s > 0.0):
        got = f"{tolerance}, {time_limit_s} s"
        raise InputError(f"the tolerance must be between 0 and 1, the time limit positive; got {got}")
    x, sign = problem.check_x(incumbent), problem.objective.sign
    cost = _evaluate_feasible(problem, x)
    started, used = time.perf_counter(), time.process_time()
    bounds, target = make_bounds(problem), target_cost(cost, tolerance)
    key = make_key(identify_problem(problem))
    proof = hash_json({**key, "x": x.tolist(), "tolerance": tolerance, "prover": PROVER})
    if checkpoint is not None and checkpoint.exists():
        tree = _read_checkpoint(checkpoint, proof, bounds.root.shape[1])
    else:
        whole = bounds.prune(bounds.root, target)
        tree = Tree(whole.boxes, whole.lowest, whole.cut, np.zeros(len(whole.origin)))
    saved, deadline = started, started + time_limit_s
    started, used = started - tree.time_s, used - tree.cpu_s  # of earlier runs
    while len(tree.lowest) and time.perf_counter() < deadline:
        _halve_best(tree, bounds, target)
        bound, left_s = tree.find_bound(target), max(deadline - time.perf_counter(), 0.0)
        gap = f"gap {100 * (cost - bound) / (abs(cost) or 1.0):.2g} % of {100 * tolerance:.2g} %"
        left = f"{100 * tree.estimate_share_left():.2g} % of the tree left, {left_s:.0f} s at most"
        progress(f"{gap}, bound {sign * bound:.6g}; {tree.enclosed:,} boxes, {left}")
        if checkpoint is not None and time.perf_counter() - saved > CHECKPOINT_S:
            saved = time.perf_counter()
            tree.time_s, tree.cpu_s = saved - started, time.process_time() - used
            _write_checkpoint(checkpoint, proof, tree)
    tree.time_s, tree.cpu_s = time.perf_counter() - started, time.process_time() - used
    if checkpoint is not None:
        _write_checkpoint(checkpoint, proof, tree)
    return Certificate(
        objective=sign * cost,
        bound=sign * tree.find_bound(target),
        tolerance=tolerance,
        closed=not len(tree.lowest),
        boxes=tree.enclosed,
        left=len(tree.lowest),
        time_s=tree.time_s,
        cpu_s=tree.cpu_s,
        x=tuple(x.tolist()),
    )


def target_cost(cost: float, tolerance: float) -> float:
    """Return the cost to prove as a lower bound."""
    return cost - tolerance * (abs(cost) or 1.0)


def _evaluate_feasible(problem: GaitProblem, x: Array) -> float:
    exact = build_exact_model(problem).at(x, problem.p)
    if not exact.violation <= FEASIBILITY_TOLERANCE:
        raise InputError(f"the incumbent of {problem.name} is infeasible: total violation {exact.violation:.3g}")
    return exact.cost


def _halve_best(tree: Tree, bounds: Bounds, target: float) -> None:
    order = np.argsort(tree.lowest, kind="stable")
    batch = max(BATCH, len(order) // SHARE)
    chosen, kept = order[:batch], order[batch:]
    new = _halve(tree.boxes[chosen], tree.cut[chosen])
    tree.enclosed += len(new)
    remaining = bounds.prune(new, target)
    depth = np.tile(tree.depth[chosen] + 1, 2)[remaining.origin]
    inherited = np.tile(tree.lowest[chosen], 2)[remaining.origin]  # also a bound of each half
    tree.boxes = np.concatenate([tree.boxes[kept], remaining.boxes])
    tree.lowest = np.concatenate([tree.lowest[kept], np.maximum(remaining.lowest, inherited)])
    tree.cut = np.concatenate([tree.cut[kept], remaining.cut])
    tree.depth = np.concatenate([tree.depth[kept], depth])


def _halve(boxes: Array, cut: Numbers) -> Array:
    """Return (2 P, n, 2): each box cut in the middle of an edge, first all lower halves."""
    index = np.arange(len(boxes)), cut
    middle = 0.5 * boxes[(*index, 0)] + 0.5 * boxes[(*index, 1)]
    low, high = boxes.copy(), boxes.copy()
    low[(*index, 1)] = middle
    high[(*index, 0)] = middle
    return np.concatenate([low, high])


def _write_checkpoint(path: Path, proof: str, tree: Tree) -> None:
    """Write a hash and rows of doubles atomically: the work, then each open box with its bound, cut and depth."""
    count, n, _ = tree.boxes.shape
    rows = np.column_stack([tree.boxes.reshape(count, 2 * n), tree.lowest, tree.cut, tree.depth])
    work = np.zeros((1, rows.shape[1]))
    work[0, :3] = tree.enclosed, tree.time_s, tree.cpu_s
    content = np.concatenate([work, rows]).astype("<f8").tobytes()
    with replace_file(path) as temporary:
        temporary.write_bytes(_hash_checkpoint(proof, content) + content)


def _read_checkpoint(path: Path, proof: str, n: int) -> Tree:
    remedy = "delete it to start the proof again"
    raw = read_bytes(path, "checkpoint", at_most=LARGEST_CHECKPOINT, remedy=remedy)
    digest, content = raw[:HASH_SIZE], raw[HASH_SIZE:]
    if digest != _hash_checkpoint(proof, content):
        other = "it is damaged, or of another problem, incumbent, tolerance or version of the prover"
        raise InputError(f"checkpoint {str(path)!r}: {other}; {remedy}")
    (work, *_), rows = np.split(np.frombuffer(content, dtype="<f8").reshape(-1, 2 * n + 3).astype(np.float64), [1])
    boxes, lowest, cut, depth = rows[:, :-3].reshape(-1, n, 2), rows[:, -3], rows[:, -2], rows[:, -1]
    return Tree(boxes, lowest, cut.astype(np.intp), depth, int(work[0]), *work[1:3].tolist())


def _hash_checkpoint(proof: str, content: bytes) -> bytes:
    return hashlib.sha256(proof.encode() + content).digest()
