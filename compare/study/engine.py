"""Gaits of a study played in the physics engine, each once: what was found is kept beside the records."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from compare.study.record import RunRecord, gait_of, run_file
from compare.study.task import LABEL
from nlp_gait.decoding import decoded
from nlp_gait.errors import InputError
from nlp_gait.files import read_json, refusing, writable_folder, write_json
from nlp_gait.formulation import Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import mujoco
from nlp_gait.simulation.measurements import measure
from nlp_gait.simulation.mjcf import plan_model
from nlp_gait.simulation.plan import Plan, plan_of
from nlp_gait.simulation.playback import play
from nlp_gait.simulation.walking import measure_walk

FOLDER = "engine"  # in a study's, with a file for each record of it
STEPS = 10  # of a cycle
SCHEMA = 1
REMEDY = "delete it to have the gait played anew"


@dataclass(frozen=True, kw_only=True)
class Played:
    """How one gait fared in the engine, beside what the model says of it.

    Attributes:
        problem: label, as in the record.
        algorithm: label, likewise.
        run: number, likewise.
        gait: problem and x that were played.
        drive: of the servos.
        steps: of a cycle; None for a phase.
        made_of: digest of the engine's model and of the planned motion, and the engine's version.
        unit: W, mean power over a phase, or J/m, energy of a cycle for each planned metre; mechanical and heat.
        model: what the model says.
        engine: what the servos drew; None after a fall.
        fell_at_s: when; None if it stayed up.
        way: walked part of the planned way; None for a phase and after a fall.
    """

    problem: str
    algorithm: str
    run: int
    gait: Mapping[str, Any]
    drive: Drive
    steps: int | None
    made_of: str
    unit: Literal["W", "J/m"]
    model: float
    engine: float | None
    fell_at_s: float | None
    way: float | None


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """Content of a file."""

    schema: Literal[1]
    played: Played


def play_records(
    folder: Path, records: Sequence[RunRecord], drive: Drive, progress: Callable[[str], None] | None = None
) -> list[Played]:
    """Play the gaits of some records, those of problems that can be played; a cycle for ten steps.

    What is kept of an earlier call is played anew only if gait, drive, robot or engine have changed.

    Args:
        folder: of the study.
        records: whose gaits.
        drive: of the servos.
        progress: told of each gait.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        InputError: a file of an earlier call is damaged.
        OutputError: the folder cannot be written to.
    """
    version = f"mujoco {mujoco().__version__}"
    found = []
    for record in records:
        result = gait_of(record)
        if result.problem.display.simulation_model is not None:
            found.append(_played(folder, record, result, drive, version))
        if progress is not None:
            progress(f"{record.problem} {record.algorithm}")
    return found


def kept_plays(folder: Path, records: Sequence[RunRecord]) -> list[Played]:
    """What earlier calls have kept of these records' gaits; nothing of a gait that has changed since. Needs no MuJoCo.

    Raises:
        InputError: a file is damaged.
    """
    found = [
        (_read(run_file(folder / FOLDER, record.problem, record.algorithm, record.run)), record) for record in records
    ]
    return [played for played, record in found if played is not None and played.gait == _gait(record)]


def _played(folder: Path, record: RunRecord, result: Result, drive: Drive, version: str) -> Played:
    repeats = result.problem.display.simulation_model is not None and result.problem.display.simulation_model.repeats
    steps = STEPS if repeats else None
    plan = plan_of(result, steps)
    made_of = f"{_digest(plan, drive)}, {version}"
    path = run_file(folder / FOLDER, record.problem, record.algorithm, record.run)
    kept = _read(path)
    if kept is not None and (kept.gait, kept.drive, kept.made_of) == (_gait(record), drive, made_of):
        return kept
    trace = play(plan, drive=drive)
    if steps is None:
        measured, way = measure(plan, trace, drive), None
        model, engine = measured.predicted.total_W, None if measured.fallen else measured.measured.total_W
    else:
        walk = measure_walk(plan, trace, drive, steps)
        model, engine = walk.model_J_per_m, walk.engine_J_per_planned_m
        way = None if walk.walked_m is None else walk.walked_m / walk.planned_m
    played = Played(
        problem=record.problem,
        algorithm=record.algorithm,
        run=record.run,
        gait=_gait(record),
        drive=drive,
        steps=steps,
        made_of=made_of,
        unit="W" if steps is None else "J/m",
        model=model,
        engine=engine,
        fell_at_s=trace.fell_at_s,
        way=way,
    )
    writable_folder(path.parent)
    write_json(path, {"schema": SCHEMA, "played": asdict(played)})
    return played


def _gait(record: RunRecord) -> dict[str, Any]:
    return {"problem": record.definition["problem"], "x": dict(record.x)}


def _digest(plan: Plan, drive: Drive) -> str:
    """Of all that is simulated but the drive's set-points, which follow from it and the drive."""
    text = plan_model(plan, drive)
    digest = hashlib.sha256(text.encode())
    for name in ("t", "q", "tau"):
        digest.update(plan.signals.arrays[name].tobytes())
    return digest.hexdigest()


def _read(path: Path) -> Played | None:
    """What a file holds; None if there is none."""
    if not path.exists():
        return None
    raw = read_json(path, "playback", remedy=REMEDY)
    with refusing(f"playback {str(path)!r} is damaged", InputError, REMEDY):
        played = decoded(_Kept, raw).played
        for title in (played.problem, played.algorithm):
            if not LABEL.fullmatch(title):
                raise ValueError(f"{title!r} is not a label of a problem or solver")
        return played
