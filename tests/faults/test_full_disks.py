"""A full disk: one sentence, exit status 1, what was finished is whole and what was computed is printed."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from compare.study.record import read_record
from tests.compare.cli.calls import nlp_gait
from tests.faults.processes import in_own_mounts


@contextmanager
def limited_files(kilobytes: int) -> Iterator[None]:
    """Limit the size of every file that this process writes."""
    usual = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (kilobytes * 1024, usual[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, usual)


@pytest.mark.slow
def test_a_study_stores_its_finished_runs_and_continues_when_there_is_room(
    tmp_path: Path, undrawn_pictures: None
) -> None:
    study = "walk12 --algorithms pso --runs 30 --evaluations 100 --starts 0 --jobs 1"
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
    assert 3 < len(records) < 30 and all(read_record(path) for path in records)
    assert not list(tmp_path.rglob("*.tmp*"))
    before = {path: path.read_bytes() for path in records}
    nlp_gait("compare", "--resume", "--out", tmp_path / "kept", "--jobs", "1")
    assert {path: path.read_bytes() for path in records} == before
    assert len(list(tmp_path.glob("kept/records/*/*.json"))) == 30


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "printed"),
    [
        (("solve", "walk12", "--starts", "2", "--out", "{out}/best.json"), "walk12: f 0.97"),
        (
            ("sweep", "walk12", "--over", "step_length_m=0.1:0.12:2", "--starts", "1", "--out", "{out}"),
            "walk12 by ipopt",
        ),
    ],
    ids=["solve", "sweep"],
)
def test_what_was_computed_is_printed_though_it_cannot_be_written(
    arguments: tuple[str, ...], printed: str, tmp_path: Path
) -> None:
    with limited_files(2):
        done = nlp_gait(*(argument.replace("{out}", str(tmp_path)) for argument in arguments), status=1)
    assert printed in done.stdout
    *kept, last = done.stderr.splitlines()
    assert last.startswith("nlp-gait: cannot write ") and "File too large" in last
    assert all("continuing without storing results" in line for line in kept) and len(kept) <= 1
    assert [path.name for path in tmp_path.iterdir() if path.suffix != ".csv" and path.name != "store"] == []
