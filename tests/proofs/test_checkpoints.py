"""Checkpoints of proofs: a killed proof continues, another prover starts again, and what is damaged or forged is one sentence."""

import io
import json
import os
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nlp_gait.errors import InputError
from nlp_gait.proofs import branch_and_bound, checkpoint
from nlp_gait.proofs.branch_and_bound import certify
from tests.backends.toys import toy
from tests.compare.questions.test_certainty import two_valleys

PROBLEM = toy(two_valleys, limit=-9.0)
BEST = np.array([-1.0124, 0.0])  # of two valleys, without its line
ROW = 7  # doubles of a box: four ends, bound, cut, depth


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return the checkpoint of a proof whose time ended with some open boxes."""
    file, notes = tmp_path_factory.mktemp("proof") / "open", list[str]()

    def wait(note: str) -> None:
        notes.append(note)
        time.sleep(1.0 if len(notes) == 3 else 0.0)

    certify(PROBLEM, BEST, tolerance=0.5)  # compiles
    assert not certify(PROBLEM, BEST, tolerance=1e-4, time_limit_s=1.0, progress=wait, checkpoint=file).closed
    return file.read_bytes()


def rewrite(raw: bytes, change: Callable[[dict[str, Any], np.ndarray], Any]) -> bytes:
    """Return a checkpoint with another header or other boxes, and the hash that fits them."""
    line, _, rows = raw.partition(b"\n")
    header, table = json.loads(line), np.frombuffer(rows).reshape(-1, ROW).copy()
    changed = change(header, table)
    rows = (table if changed is None else changed).tobytes()
    try:
        work = header["enclosed"], header["time_s"], header["cpu_s"]
        header["content"] = checkpoint._hash_content(rows, work)
    except (KeyError, TypeError):
        pass
    return json.dumps(header).encode() + b"\n" + rows


def set_box(place: int, value: float) -> Callable[[bytes], bytes]:
    def change(header: dict[str, Any], table: np.ndarray) -> None:
        table[0, place] = value

    return lambda raw: rewrite(raw, change)


def set_header(**values: Any) -> Callable[[bytes], bytes]:
    return lambda raw: rewrite(raw, lambda header, table: header.update(values))


def make_bomb(raw: bytes) -> bytes:
    """Return an archive of 100 kB that unpacks to 100 MB."""
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("boxes.npy", bytes(100 * 2**20))
    return memory.getvalue()


FORGERIES: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "half of the boxes dropped": (lambda raw: raw[: -8 * ROW], "does not have the hash"),
    "all boxes dropped": (lambda raw: raw.partition(b"\n")[0] + b"\n", "does not have the hash"),
    "a bound raised": (lambda raw: raw[:-24] + np.float64(1e9).tobytes() + raw[-16:], "does not have the hash"),
    "a bit flipped": (lambda raw: raw[:-1] + bytes([raw[-1] ^ 1]), "does not have the hash"),
    "fewer boxes counted": (lambda raw: raw.replace(b'"enclosed": ', b'"enclosed": 1', 1), "does not have the hash"),
    "end not a number": (set_box(0, np.nan), "a box is empty or outside"),
    "ends inverted": (set_box(1, -np.inf), "a box is empty or outside"),
    "box outside the root": (set_box(0, -1e9), "a box is empty or outside"),
    "bound not a number": (set_box(4, np.nan), "not a number, or infinite"),
    "bound infinite": (set_box(4, np.inf), "not a number, or infinite"),
    "cut of no variable": (set_box(5, 2.0), "index of one of 2 variables"),
    "cut negative": (set_box(5, -1.0), "index of one of 2 variables"),
    "cut between variables": (set_box(5, 0.5), "index of one of 2 variables"),
    "cut not a number": (set_box(5, np.nan), "index of one of 2 variables"),
    "depth negative": (set_box(6, -1.0), "depth of a box"),
    "depth not a number": (set_box(6, np.nan), "depth of a box"),
    "half a row": (lambda raw: rewrite(raw, lambda header, table: table.ravel()[:-1]), "cannot reshape"),
    "no boxes enclosed": (set_header(enclosed=0), "at least one box"),
    "time negative": (set_header(time_s=-1.0), "at least 0 s"),
    "text for a number": (set_header(cpu_s="much"), "cpu_s must be a number"),
    "list for a text": (set_header(proof=[]), "proof must be a text"),
    "unknown key": (set_header(boxes=3), "unknown key"),
    "key missing": (lambda raw: rewrite(raw, lambda header, table: header.pop("proof") and None), "proof is missing"),
    "other proof": (set_header(proof="0" * 64), "another problem, incumbent or tolerance"),
    "text": (lambda raw: b"torn", "damaged"),
    "empty": (lambda raw: b"", "damaged"),
    "brackets": (lambda raw: b"[" * 100_000, "damaged"),
    "not an object": (lambda raw: b"7\n", "must be an object"),
    "zip bomb": (make_bomb, "damaged"),
}


@pytest.mark.parametrize("name", FORGERIES)
def test_a_damaged_or_forged_checkpoint_is_one_sentence(name: str, written: bytes, tmp_path: Path) -> None:
    forge, message = FORGERIES[name]
    (tmp_path / "open").write_bytes(forge(written))
    with pytest.raises(InputError, match=message) as refusal:
        certify(PROBLEM, BEST, tolerance=1e-4, checkpoint=tmp_path / "open")
    text = str(refusal.value)
    assert "\n" not in text and text.endswith("delete it to start the proof again") and len(text) < 400


def test_a_killed_proof_continues_to_the_same_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def kill(note: str) -> None:
        if (tmp_path / "open").exists():
            raise KeyboardInterrupt

    monkeypatch.setattr(branch_and_bound, "CHECKPOINT_S", 0.0)
    with pytest.raises(KeyboardInterrupt):
        certify(PROBLEM, BEST, tolerance=1e-4, progress=kill, checkpoint=tmp_path / "open")
    resumed, whole = (
        certify(PROBLEM, BEST, tolerance=1e-4, checkpoint=tmp_path / "open"),
        certify(PROBLEM, BEST, tolerance=1e-4),
    )
    assert resumed.closed and (resumed.boxes, resumed.bound) == (whole.boxes, whole.bound)


def test_a_pipe_is_not_a_checkpoint(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "open")
    with pytest.raises(InputError, match="not a regular file"):
        certify(PROBLEM, BEST, tolerance=1e-4, checkpoint=tmp_path / "open")


def test_a_proof_does_not_continue_from_the_checkpoint_of_another_prover(written: bytes, tmp_path: Path) -> None:
    whole, notes, file = certify(PROBLEM, BEST, tolerance=1e-4), list[str](), tmp_path / "open"
    # Another version dropped all boxes; its own hash fits.
    file.write_bytes(rewrite(written, lambda header, table: header.update(prover=2) or table[:0]))
    found = certify(PROBLEM, BEST, tolerance=1e-4, progress=notes.append, checkpoint=file)
    assert "was made by another version of the prover; the proof starts again" in notes[0]
    assert (found.boxes, found.bound) == (whole.boxes, whole.bound)
