"""Checkpoints of proofs: a killed proof continues, and what is damaged is one sentence."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from nlp_gait.errors import InputError
from nlp_gait.proofs import branch_and_bound
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


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "half of the boxes dropped": lambda raw: raw[: -8 * ROW],
    "a bit flipped": lambda raw: raw[:-1] + bytes([raw[-1] ^ 1]),
    "empty": lambda raw: b"",
}


@pytest.mark.parametrize("name", [*DAMAGES, "other tolerance"])
def test_a_damaged_checkpoint_is_one_sentence(name: str, written: bytes, tmp_path: Path) -> None:
    (tmp_path / "open").write_bytes(DAMAGES[name](written) if name in DAMAGES else written)
    tolerance = 1e-4 if name in DAMAGES else 1e-5
    with pytest.raises(InputError, match="damaged, or of another problem, .*; delete it to start the proof again$"):
        certify(PROBLEM, BEST, tolerance=tolerance, checkpoint=tmp_path / "open")


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
