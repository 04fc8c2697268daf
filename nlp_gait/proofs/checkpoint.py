"""Checkpoints of proofs: the open boxes in a file, with hashes of what is proven and of the content.

A file is a line of JSON and then rows of doubles, one for each open box: its ends, the lower bound of its cost, its next cut and
its depth. It cannot unpack to more than its size.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, read_bytes, replace_file
from nlp_gait.formulation import Array
from nlp_gait.proofs.boxes import Numbers

# Version of the prover, written into certificates and checkpoints: raise it by hand where a change of this package decides what
# remains of a box, or what a proof is.
PROVER = 1
LARGEST_CHECKPOINT = 2**31  # bytes; ten million open boxes of nine variables


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


@dataclass(frozen=True)
class _Header:
    """First line of a checkpoint."""

    proof: str  # hash of problem, incumbent, tolerance and version of the prover
    content: str  # hash of the next three numbers and of all rows
    enclosed: int
    time_s: float
    cpu_s: float


def write_checkpoint(path: Path, proof: str, tree: Tree) -> None:
    """Write a checkpoint atomically; raises OutputError."""
    count, n, _ = tree.boxes.shape
    columns = [tree.boxes.reshape(count, 2 * n), tree.lowest[:, None], tree.cut[:, None], tree.depth[:, None]]
    rows = np.concatenate(columns, axis=1).astype("<f8").tobytes()
    work = tree.enclosed, tree.time_s, tree.cpu_s
    header = _Header(proof, _hash_content(rows, work), *work)
    with replace_file(path) as temporary:
        temporary.write_bytes(json.dumps(asdict(header)).encode() + b"\n" + rows)


def read_checkpoint(path: Path, proof: str, n: int) -> Tree:
    """Return the open boxes of a proof with n variables.

    Raises:
        InputError: the file is damaged, or belongs to another proof.
    """
    remedy = "delete it to start the proof again"
    raw = read_bytes(path, "checkpoint", at_most=min(path.stat().st_size, LARGEST_CHECKPOINT), remedy=remedy)
    line, _, rows = raw.partition(b"\n")
    with convert_errors(f"checkpoint {str(path)!r} is damaged", InputError, remedy):
        header = decode(_Header, json.loads(line), "header")
        work = header.enclosed, header.time_s, header.cpu_s
        if header.content != _hash_content(rows, work):
            raise ValueError("its content does not have the hash that its header states")
        if header.proof != proof:
            raise ValueError("it belongs to another problem, incumbent, tolerance or version of the prover")
        table = np.frombuffer(rows, dtype="<f8").reshape(-1, 2 * n + 3).astype(np.float64)
    boxes, lowest, cut, depth = table[:, :-3].reshape(-1, n, 2), table[:, -3], table[:, -2], table[:, -1]
    return Tree(boxes, lowest, cut.astype(np.intp), depth, *work)


def _hash_content(rows: bytes, work: tuple[int, float, float]) -> str:
    return hashlib.sha256(json.dumps(work).encode() + rows).hexdigest()
