"""Independent steps of a reproduction side by side in worker processes, each kept as a file as soon as it is done."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.study.steps import Steps
from compare.study.workers import default_jobs
from nlp_gait.backends.interrupts import children_ignore_interrupts


@dataclass(frozen=True, kw_only=True)
class Job:
    """A step that can run in another process.

    Attributes:
        name: of the step and its file.
        inputs: everything that the result depends on, as plain data.
        compute: a function of a module, for it crosses process borders.
        arguments: of that function, by name.
        beside: file that the function writes beside its result; without it the step is done anew.
    """

    name: str
    inputs: Mapping[str, Any]
    compute: Callable[..., Any]
    arguments: Mapping[str, Any]
    beside: Path | None = None


def run_jobs(out: Path, jobs: Sequence[Job], progress: Callable[[str], None]) -> list[Any]:
    """Results of all jobs, in their order; what an earlier call has finished is read from its file.

    Args:
        out: folder of the reproduction.
        jobs: with different names.
        progress: told the name of each job when it is done.
    """
    results = []
    for job, result in zip(jobs, _results(out, jobs), strict=True):
        progress(job.name)
        results.append(result)
    return results


def _results(out: Path, jobs: Sequence[Job]) -> Iterator[Any]:
    workers = min(default_jobs(), len(jobs))
    if workers <= 1:
        yield from (_run(out, job) for job in jobs)
        return
    from joblib import Parallel, delayed  # costs 0.1 s to import

    parallel = Parallel(n_jobs=workers, return_as="generator", batch_size=1, pre_dispatch="all")
    with children_ignore_interrupts():
        results = parallel(delayed(_run)(out, job) for job in jobs)
    yield from results


def _run(out: Path, job: Job) -> Any:
    steps = Steps(out, lambda note: None, code=(sys.modules[job.compute.__module__],))
    if job.beside is not None and not job.beside.exists():
        (out / "steps" / f"{job.name}.json").unlink(missing_ok=True)
    return steps(job.name, job.inputs, lambda: job.compute(**job.arguments))
