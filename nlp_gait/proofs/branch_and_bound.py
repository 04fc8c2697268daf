"""Branch and bound with rigorous bounds: how good any feasible x can be.

A box is dropped when bounds of its rows show that no point in it is feasible, or of its cost that none betters the
incumbent by more than the tolerance; the slabs of it in which that is so are cut off. The rest is halved, the box with the best
bound first. What happens to a box depends on the box alone, so that any path from the whole to a dropped box can be followed
again (``certificate.py``).

Source:
    Hansen, Walster (2004), Global Optimization Using Interval Analysis; Moore, Kearfott, Cloud (2009), chapter 6.
"""

from __future__ import annotations

import time
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import fingerprint, sha256_of
from nlp_gait.errors import InputError
from nlp_gait.files import new_file
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.proofs.bounds import Bounds, bounds_of
from nlp_gait.proofs.boxes import Numbers, halves

# Boxes that are halved together: so many, or this share of all that are open, so that keeping order costs little.
BATCH, SHARE = 1024, 8
CHECKPOINT_S = 30.0


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """What is proven about the best possible objective.

    Attributes:
        objective: exact value of the incumbent, in the problem's sense.
        bound: no x within the variables' bounds that the judge calls feasible has a better objective than this; not finite
            where the time limit came before any such bound.
        tolerance: requested distance of bound and objective, relative.
        closed: that distance was reached.
        boxes: number that were enclosed.
        left: number of boxes neither dropped nor split at the end.
        time_s: wall time [s].
        cpu_s: processor time [s].
        x: the incumbent.
    """

    objective: float
    bound: float
    tolerance: float
    closed: bool
    boxes: int
    left: int
    time_s: float
    cpu_s: float
    x: tuple[float, ...]

    @property
    def gap(self) -> float:
        """Distance of bound and objective, relative to the objective."""
        return abs(self.bound - self.objective) / abs(self.objective)


@dataclass(kw_only=True)
class _Tree:
    """Boxes that are still open, and what was done.

    Attributes:
        boxes: (P, n, 2).
        lowest: (P,) bound of the cost in each.
        cut: (P,) variable to cut next.
        depth: (P,) number of cuts that led there.
        enclosed: boxes so far.
        time_s: wall time so far [s].
        cpu_s: processor time so far [s].
    """

    boxes: Array
    lowest: Array
    cut: Numbers
    depth: Array
    enclosed: int = 1
    time_s: float = 0.0
    cpu_s: float = 0.0

    def share_left(self) -> float:
        """Share of the tree that is open, if every half of a box were as much work as the other."""
        return float(np.exp2(-self.depth.astype(float)).sum())


def certify(
    problem: GaitProblem,
    incumbent: Array,
    *,
    tolerance: float = 0.01,
    time_limit_s: float = 300.0,
    progress: Progress = ignore_progress,
    checkpoint: Path | None = None,
) -> Certificate:
    """Bound on the optimum within the variables' bounds.

    Args:
        problem: with few variables: the work grows exponentially with their number.
        incumbent: (n,) feasible point, the best known.
        tolerance: relative distance of bound and objective at which to stop.
        time_limit_s: wall time after which the bound reached so far is returned [s].
        progress: told the boxes enclosed, the bound in the problem's sense and the share of the tree that is left.
        checkpoint: file that keeps what is open, every half minute and at the end, so that a run goes on where it was killed;
            one of another problem, incumbent or tolerance is refused.

    Raises:
        InputError: the incumbent is not feasible, the tolerance or the time limit is not positive, or the checkpoint is of
            another proof.
        CompilerError: there is no compiler, or it fails.
    """
    if not (tolerance > 0.0 and time_limit_s > 0.0):
        raise InputError(f"tolerance and time limit must be positive, got {tolerance}, {time_limit_s} s")
    x = problem.check_x(incumbent)
    at = build_exact_model(problem).at(x, problem.p)
    if not at.violation <= FEASIBILITY_TOLERANCE:
        raise InputError(f"the incumbent of {problem.name} is infeasible: total violation {at.violation:.3g}")
    started, used = time.perf_counter(), time.process_time()
    bounds, target = bounds_of(problem), target_of(at.cost, tolerance)
    identity = sha256_of(
        {**fingerprint(problem), "x": x.tolist(), "tolerance": tolerance, "whole": bounds.whole.tolist()}
    )
    tree = _read(checkpoint, identity) or _root(bounds, target)
    before = tree.time_s, tree.cpu_s
    saved = started

    def bound() -> float:
        return problem.objective.sign * float(tree.lowest.min(initial=target))

    while len(tree.lowest) and time.perf_counter() - started < time_limit_s:
        _advance(tree, bounds, target)
        progress(f"{tree.enclosed} boxes, bound {bound():.6g}, {100 * tree.share_left():.2g} % of the tree left")
        if checkpoint is not None and time.perf_counter() - saved > CHECKPOINT_S:
            _spent(tree, before, started, used)
            _write(checkpoint, identity, tree)
            saved = time.perf_counter()
    _spent(tree, before, started, used)
    if checkpoint is not None:
        _write(checkpoint, identity, tree)
    return Certificate(
        objective=problem.objective.sign * at.cost,
        bound=bound(),
        tolerance=tolerance,
        closed=not len(tree.lowest),
        boxes=tree.enclosed,
        left=len(tree.lowest),
        time_s=tree.time_s,
        cpu_s=tree.cpu_s,
        x=tuple(x.tolist()),
    )


def target_of(cost: float, tolerance: float) -> float:
    """Cost that no feasible point may undercut."""
    return cost - tolerance * abs(cost)


def _root(bounds: Bounds, target: float) -> _Tree:
    boxes, lowest, cut, origin = bounds.assess(bounds.whole, target)
    return _Tree(boxes=boxes, lowest=lowest, cut=cut, depth=np.zeros(len(origin)))


def _advance(tree: _Tree, bounds: Bounds, target: float) -> None:
    """Halve the boxes with the best bounds."""
    order = np.argsort(tree.lowest, kind="stable")
    batch = max(BATCH, len(order) // SHARE)
    chosen, rest = order[:batch], order[batch:]
    new = halves(tree.boxes[chosen], tree.cut[chosen])
    tree.enclosed += len(new)
    found = bounds.assess(new, target)
    depth = np.tile(tree.depth[chosen] + 1, 2)[found.origin]
    inherited = np.tile(tree.lowest[chosen], 2)[found.origin]  # a half has no less than the whole
    tree.boxes = np.concatenate([tree.boxes[rest], found.boxes])
    tree.lowest = np.concatenate([tree.lowest[rest], np.maximum(found.lowest, inherited)])
    tree.cut = np.concatenate([tree.cut[rest], found.cut])
    tree.depth = np.concatenate([tree.depth[rest], depth])


def _spent(tree: _Tree, before: tuple[float, float], started: float, used: float) -> None:
    tree.time_s = before[0] + time.perf_counter() - started
    tree.cpu_s = before[1] + time.process_time() - used


def _write(path: Path, identity: str, tree: _Tree) -> None:
    """Under another name, then renamed: a killed run leaves the last whole one."""
    parts: Mapping[str, Any] = vars(tree)
    with new_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, identity=np.array(identity), **parts)


def _read(path: Path | None, identity: str) -> _Tree | None:
    """What a checkpoint holds, None without one."""
    if path is None or not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as kept:
            parts = {name: kept[name] for name in kept.files}
        found = str(parts.pop("identity"))
        numbers = {name: parts.pop(name).item() for name in ("enclosed", "time_s", "cpu_s")}
        tree = _Tree(**parts, **numbers)
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(f"checkpoint {str(path)!r} is damaged: {error}; delete it to begin again") from error
    if found != identity:
        raise InputError(f"checkpoint {str(path)!r} is of another proof; delete it, or name another file")
    return tree
