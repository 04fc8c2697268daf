"""A submission holds as it is written, and no number in it can be edited, whether its hashes are computed again or not."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compare.archive.pack import write_archive
from compare.archive.unpack import MANIFEST
from compare.archive.verify import Finding
from compare.bench.baseline import make_bench_study, parse_seeds
from compare.bench.leaderboard import filter_instances
from compare.bench.submission import check_rules, pack_submission, verify_submission, write_public_pages
from compare.study.evidence import check_claims, check_history
from compare.study.record import RunRecord
from compare.study.run_study import Study, run_study
from compare.study.settings import Session, SolverSpec, write_manifest
from nlp_gait.errors import InputError
from nlp_gait.gaitbench.generated import find_test_day

ID = "walk12-w015"
EDITS = 12
# What a run says about its machine and its clock cannot be checked.
UNCHECKED = ("time_s", "origin", "solver_version", "session")


def run(folder: Path, instances: tuple[str, ...] = (ID,)) -> list[RunRecord]:
    settings = make_bench_study(instances, SolverSpec(name="pso"), runs=2, evaluations=100)
    write_manifest(folder, settings, Session.begin("nlp-gait bench", "1"))
    return run_study(Study(tasks=settings.tasks(), folder=folder))


@pytest.fixture(scope="module")
def submission(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench")
    run(folder)
    return pack_submission(folder, folder / "submission.zip")


def list_numbers(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the place of every number in a record."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        if key in UNCHECKED:
            continue
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            yield (*path, key)
        yield from list_numbers(value, (*path, key))


def edit(path: Path, out: Path, seed: int, *, rehash: bool) -> tuple[Any, ...]:
    """Write a copy with one number of one record edited, and return its place."""
    rng = np.random.default_rng(seed)
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    record = str(rng.choice(sorted(name for name in content if name.startswith("records/"))))
    data = json.loads(content[record])
    place = list(list_numbers(data))
    chosen = place[int(rng.integers(len(place)))]
    inner = data
    for key in chosen[:-1]:
        inner = inner[key]
    old = inner[chosen[-1]]
    inner[chosen[-1]] = old + 1 if isinstance(old, int) else old * (1 - 1e-3) - 1e-6
    content[record] = json.dumps(data).encode()
    if rehash:
        content.pop(MANIFEST)
        write_archive(out, content, {})
    else:
        with zipfile.ZipFile(out, "w") as copy:
            for name, part in content.items():
                copy.writestr(name, part)
    return chosen


def test_a_submission_holds_as_it_was_written(submission: Path) -> None:
    findings, records = verify_submission(submission, share=1.0)
    assert [f.sentence for f in findings if not f.holds] == []
    assert len(records) == 2 and sum(f.what.startswith("repeated") for f in findings) == 2


@pytest.mark.parametrize("seed", range(EDITS))
def test_an_edited_number_is_rejected(submission: Path, tmp_path: Path, seed: int) -> None:
    """With the hashes as they were and computed again; the 100 of ``python -m benchmarks.gaitbench.edits`` likewise."""
    place = edit(submission, tmp_path / "edited.zip", seed, rehash=seed % 2 == 0)
    try:
        findings, _ = verify_submission(tmp_path / "edited.zip", share=1.0)
    except InputError:
        return
    assert not all(f.holds for f in findings), place


def test_rules(tmp_path: Path) -> None:
    """Training seeds are not for submissions; test seeds of the day are; every instance has the same runs."""
    records = run(tmp_path, ("gb2:walk12-long:0",))
    assert [f.what for f in check_rules(records) if not f.holds] == ["instances"]
    with pytest.raises(InputError, match="cannot be submitted: instances: DOES NOT HOLD"):
        pack_submission(tmp_path, tmp_path / "x.zip")
    assert [f.what for f in check_rules(records[1:]) if not f.holds] == ["seeds of runs", "instances"]
    assert not check_rules([])[0].holds
    assert all(map(find_test_day, parse_seeds("test:3")))


def test_pages_rank_what_holds_and_name_what_does_not(submission: Path, tmp_path: Path) -> None:
    folder, out = tmp_path / "in", tmp_path / "out"
    folder.mkdir()
    (folder / "good.zip").write_bytes(submission.read_bytes())
    (folder / "bad.zip").write_bytes(b"PK")
    written, rejected = write_public_pages(folder, out)
    assert len(rejected) == 1 and rejected[0].startswith("bad.zip: ")
    index = (out / "index.html").read_text(encoding="utf-8")
    assert "100 evaluations, 2 runs" in index and "bad.zip" in index
    ranking = next(path for path in written if path.name == "ranking.html")
    assert f'href="{ranking.parent.name}/ranking.html"' in index and "pso" in ranking.read_text(encoding="utf-8")


@pytest.mark.usefixtures("undrawn_pictures")
def test_searches_with_similar_names_have_pages_of_their_own(
    submission: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Names that differ in punctuation or case only; user code of submissions whose files are named so is not mixed, either."""
    _, records = verify_submission(submission, share=0.0)
    names = {"a b.zip": "pso a", "a-b.zip": "pso-a", "A-b.zip": "PSO-a"}

    def verify(path: Path, *, share: float) -> tuple[list[Finding], list[RunRecord]]:
        user = [replace(record, solver="mine", definition={**record.definition, "solver": {}}) for record in records]
        return [], [*(replace(record, solver=names[path.name]) for record in records), *user]

    monkeypatch.setattr("compare.bench.submission.verify_submission", verify)
    (tmp_path / "in").mkdir()
    for name in names:
        (tmp_path / "in" / name).touch()
    written, _ = write_public_pages(tmp_path / "in", tmp_path / "out")
    pages = [str(path).lower() for path in written if path.suffix == ".html"]
    assert len(pages) == len(set(pages)) == 1 + 1 + 6, pages


def test_filters_are_parts_of_the_instances() -> None:
    found = filter_instances(["walk12-w015", "ssp-v5", "gb2:ssp:0", "gb2:humanoid-ssp:0"])
    assert found["all instances"] == ("walk12-w015", "ssp-v5", "gb2:ssp:0", "gb2:humanoid-ssp:0")
    assert found["family ssp"] == ("gb2:ssp:0",) and found["family nao-ssp"] == ("ssp-v5",)
    assert found["more than 10 variables"] == ("gb2:humanoid-ssp:0",)
    assert set(filter_instances(["ssp-v5"])) == {"all instances"}


def test_a_forged_history_is_found_without_repeating_its_run(tmp_path: Path) -> None:
    """What contradicts the run's own counts, its end or the judge is found; an improvement moved to an earlier entry is not."""
    record = run(tmp_path)[0]
    history, last = record.history, record.verdict.objective
    assert not [*check_history(record), *check_claims(record)]
    sooner = replace(history, evaluations=(10, *history.evaluations[1:]))
    assert not [*check_history(replace(record, history=sooner))]
    worse = last + (1.0 if record.definition["objective"]["sense"] == "minimise" else -1.0)
    forged: dict[str, dict[str, Any]] = {
        "worsens": {"history": replace(history, objective=(last, worse))},
        "but the judge finds": {"history": replace(history, objective=(last + 1.0, last + 1.0))},
        "two entries at the same number": {"history": replace(history, evaluations=(100, 100))},
        "more than its 1 iterations": {"iterations": 1},
        "it counts 60 of 100 evaluations": {
            "evaluations": {"f": 60},
            "history": replace(history, evaluations=(50, 60)),
        },
        "ended by: no better point": {"status": "no better point in 5 generations"},
    }
    for words, changes in forged.items():
        found = replace(record, **changes)
        assert any(words in reason for reason in (*check_history(found), *check_claims(found))), words
