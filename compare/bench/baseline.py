"""The rules of GaitBench 1, and the shipped records of its baseline: one compressed file for each instance.

A packed record lacks time histories, the dense grid, prices and indexes; ``benchmarks.gaitbench.baseline`` packs them.
"""

import gzip
import json
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Literal

from compare.study.record import RunRecord, decode_record
from compare.study.settings import SolverSpec, StudySettings
from compare.study.task import ProblemSpec, Stop
from nlp_gait import gaitbench
from nlp_gait.errors import InputError
from nlp_gait.gaitbench.facts import Subset
from nlp_gait.gaitbench.generated import is_generated, list_test_seeds, make_id

# Rules: the same runs, budget and seeds for all solvers.
RUNS = 15
EVALUATIONS = 10_000  # as in the papers: 50 candidates, 200 generations
BASELINE = tuple("random pso ga aco aco-grid cma de pymoo:GA pymoo:DE pymoo:ISRES slsqp ipopt".split())
FOLDER = Path(__file__).with_name("records")
DRAWN = "drawn"  # folder below it, and the suite, of drawn instances: fewer runs of the same solvers
SEEDS = re.compile(r"([0-9]{1,12}):([0-9]{1,12})")
MOST_SEEDS = 1000


def choose_instances(
    suite: Subset | Literal["drawn"], instances: str | None = None, families: str | None = None, seeds: str = "0:5"
) -> tuple[str, ...]:
    """Return the ids of instances: of a suite, or those of a list, or those that families draw by seeds; both as texts.

    Raises as ``parse_seeds``, and UnknownNameError if there is no such instance or family.
    """
    chosen = () if instances is None else tuple(name.strip() for name in instances.split(","))
    if families is not None:
        drawn = parse_seeds(seeds)
        chosen += tuple(make_id(family.strip(), seed) for family in families.split(",") for seed in drawn)
    chosen = chosen or (list_drawn() if suite == "drawn" else gaitbench.list_instances(suite))
    for id in chosen:
        gaitbench.load(id)  # raises for unknown ids
    return chosen


def parse_seeds(text: str) -> tuple[int, ...]:
    """Return the seeds of ``0:15`` (15 is not among them), ``3,5,8`` or ``test:5``, today's; raises InputError."""
    if text.startswith("test:") and text.removeprefix("test:").isdecimal():
        return list_test_seeds(datetime.now(UTC).date(), int(text.removeprefix("test:")))
    match = SEEDS.fullmatch(text)
    seeds = tuple(range(int(match[1]), int(match[2]))) if match else ()
    if not match and all(part.strip().isdecimal() for part in text.split(",")):
        seeds = tuple(int(part) for part in text.split(","))
    if not 0 < len(seeds) <= MOST_SEEDS:
        raise InputError(
            f"--seeds takes FIRST:END, test:COUNT or numbers with commas, at most {MOST_SEEDS}, got {text!r}"
        )
    return seeds


def make_bench_study(
    instances: Sequence[str], *solvers: SolverSpec, runs: int = RUNS, evaluations: int = EVALUATIONS
) -> StudySettings:
    """Return the study of some solvers on some instances; run k has the seed k."""
    problems = tuple(ProblemSpec(name=id) for id in instances)
    return StudySettings(problems=problems, solvers=solvers, runs=runs, starts=runs, stop=Stop(evaluations=evaluations))


def list_baselines(folder: Path = FOLDER) -> tuple[str, ...]:
    """Return the ids of the instances with baseline records, without drawn ones."""
    return tuple(sorted(path.name.removesuffix(".json.gz") for path in folder.glob("*.json.gz")))


def list_drawn(folder: Path = FOLDER) -> tuple[str, ...]:
    """Return the ids of the drawn instances with baseline records."""
    return tuple(id.replace("_", ":") for id in list_baselines(folder / DRAWN))


def locate_records(instance: str, folder: Path | None) -> Path:
    """Return the file of an instance's records: Windows allows no colons in names."""
    folder = folder or (FOLDER / DRAWN if is_generated(instance) else FOLDER)
    return folder / f"{instance.replace(':', '_')}.json.gz"


@cache
def load_baseline(instance: str, folder: Path | None = None) -> tuple[RunRecord, ...]:
    """Return the records of all solvers of the baseline on an instance; raises InputError if none are shipped."""
    path = locate_records(instance, folder)
    if not path.is_file():
        available = ", ".join((*list_baselines(folder or FOLDER), *list_drawn(folder or FOLDER)))
        raise InputError(f"no baseline records of {instance!r} are shipped; available: {available}")
    return tuple(map(decode_record, json.loads(gzip.decompress(path.read_bytes()))))
