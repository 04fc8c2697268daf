"""Full disks: what is finished is whole, and one sentence says what could not be written."""

import resource
import sys
from pathlib import Path

import pytest

from compare.study.record import read_record
from tests.compare.cli.calls import nlp_gait
from tests.faults.processes import in_own_mounts


def test_a_study_stores_its_finished_runs_and_continues_when_there_is_room(
    tmp_path: Path, coarse_pictures: None
) -> None:
    study = "walk12 --algorithms random --runs 20 --evaluations 100 --starts 0 --jobs 1"
    script = (
        'mkdir "$2/small"; mount -t tmpfs -o size=48k none "$2/small"; '
        f'"$1" -m nlp_gait compare {study} --out "$2/small/study" || code=$?; '
        'cp -r "$2/small/study" "$2/kept"; exit $code'
    )
    done = in_own_mounts(script, str(tmp_path))
    records = sorted(tmp_path.glob("kept/records/*/*.json"))
    assert done.returncode == 1 and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("nlp-gait: cannot write ") and "No space left on device" in done.stderr
    assert f"the {len(records)} runs before it are stored" in done.stderr
    assert 3 < len(records) < 20 and all(read_record(path) for path in records)
    assert not list(tmp_path.rglob("*.tmp*"))
    before = {path: path.read_bytes() for path in records}
    nlp_gait("compare", *study.split(), "--out", tmp_path / "kept")
    assert {path: path.read_bytes() for path in records} == before
    assert len(list(tmp_path.glob("kept/records/*/*.json"))) == 20


@pytest.mark.parametrize(
    ("line", "printed"),
    [
        ("solve walk12 --starts 2 --out {out}/best.json", "walk12: f 0.97"),
        ("sweep walk12 --over step_length_m=0.1:0.12:2 --starts 1 --out {out}", "walk12 by ipopt"),
    ],
)
def test_what_was_computed_is_printed_though_it_cannot_be_written(
    line: str, printed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # else modules that are imported now would be cut
    usual = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2048, usual[1]))
    try:
        done = nlp_gait(*line.format(out=tmp_path).split(), status=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, usual)
    assert printed in done.stdout
    *kept, last = done.stderr.splitlines()
    assert last.startswith("nlp-gait: cannot write ") and "File too large" in last
    assert all("continuing without storing results" in line for line in kept) and len(kept) <= 1
    assert [path.name for path in tmp_path.iterdir() if path.suffix != ".csv" and path.name != "store"] == []
