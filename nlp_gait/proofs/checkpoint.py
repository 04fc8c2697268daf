"""Checkpoints of proofs: the open boxes in a file, with the problem, the version of the prover, and a hash of the content.

A file is a line of JSON and then rows of doubles, one for each open box: its ends, the lower bound of its cost, its next cut and
its depth. It cannot unpack to more than its size.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.backends.identity import describe_difference
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, read_bytes, replace_file
from nlp_gait.formulation import Array
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.proofs.boxes import Numbers

# Version of the prover, written into certificates and checkpoints: raise it by hand where a change of this package decides what
# remains of a box, or what a proof is.
PROVER = 1
LARGEST_CHECKPOINT = 2**31  # bytes; ten million open boxes of nine variables
DEEPEST = 1000  # halvings; boxes of doubles have fewer


@dataclass(kw_only=True)
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


@dataclass(frozen=True)
class _Header:
    """First line of a checkpoint."""

    problem: StoredProblem
    proof: str  # hash of problem, incumbent and tolerance
    prover: int  # version
    content: str  # hash of the next three numbers and of all rows
    enclosed: int
    time_s: float
    cpu_s: float


def write_checkpoint(path: Path, problem: Mapping[str, Any], proof: str, tree: Tree) -> None:
    """Write a checkpoint atomically; raises OutputError."""
    count, n, _ = tree.boxes.shape
    columns = [tree.boxes.reshape(count, 2 * n), tree.lowest[:, None], tree.cut[:, None], tree.depth[:, None]]
    rows = np.concatenate(columns, axis=1).astype("<f8").tobytes()
    work = tree.enclosed, tree.time_s, tree.cpu_s
    stored = decode(StoredProblem, problem, "problem")
    header = _Header(stored, proof, PROVER, _hash_content(rows, work), *work)
    with replace_file(path) as temporary:
        temporary.write_bytes(json.dumps(asdict(header)).encode() + b"\n" + rows)


def read_checkpoint(path: Path, problem: Mapping[str, Any], proof: str, root: Array) -> Tree | None:
    """Return the open boxes of a proof within ``root`` (1, n, 2); None if another version of the prover made them.

    Raises:
        InputError: the file is damaged, or belongs to another proof.
    """
    remedy = "delete it to start the proof again"
    raw = read_bytes(path, "checkpoint", at_most=min(path.stat().st_size, LARGEST_CHECKPOINT), remedy=remedy)
    line, _, rows = raw.partition(b"\n")
    with convert_errors(f"checkpoint {str(path)!r} is damaged", InputError, remedy), np.errstate(invalid="ignore"):
        header = decode(_Header, json.loads(line), "header")
        if header.content != _hash_content(rows, (header.enclosed, header.time_s, header.cpu_s)):
            raise ValueError("its content does not have the hash that its header states")
        if header.proof != proof:
            raise ValueError("it belongs to another problem, incumbent or tolerance")
        if difference := describe_difference(asdict(header.problem), problem):
            raise ValueError(f"its problem has changed: {difference}")
        if header.prover != PROVER:
            return None
        n = root.shape[1]
        table = np.frombuffer(rows, dtype="<f8").reshape(-1, 2 * n + 3).astype(np.float64)
        tree = Tree(
            boxes=table[:, : 2 * n].reshape(-1, n, 2),
            lowest=table[:, -3],
            cut=table[:, -2].astype(np.intp),
            depth=table[:, -1],
            enclosed=header.enclosed,
            time_s=header.time_s,
            cpu_s=header.cpu_s,
        )
        _check_tree(tree, table[:, -2], root)
    return tree


def _hash_content(rows: bytes, work: tuple[int, float, float]) -> str:
    return hashlib.sha256(json.dumps(work).encode() + rows).hexdigest()


def _check_tree(tree: Tree, cut: Array, root: Array) -> None:
    low, high = tree.boxes[..., 0], tree.boxes[..., 1]
    if not ((root[..., 0] <= low) & (low <= high) & (high <= root[..., 1])).all():
        raise ValueError("a box is empty or outside the bounds of the variables")
    if not ((cut == tree.cut) & (0 <= cut) & (cut < root.shape[1])).all():
        raise ValueError(f"the next cut of a box must be the index of one of {root.shape[1]} variables")
    if not ((0.0 <= tree.depth) & (tree.depth <= DEEPEST)).all():
        raise ValueError(f"the depth of a box must be 0 to {DEEPEST}")
    if np.isnan(tree.lowest).any() or (tree.lowest == np.inf).any():
        raise ValueError("the lower bound of a box is not a number, or infinite")
    if tree.enclosed < 1 or not (0.0 <= tree.time_s < math.inf and 0.0 <= tree.cpu_s < math.inf):
        raise ValueError("the work so far must be at least one box and at least 0 s")
