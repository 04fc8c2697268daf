"""Simulations of a study's gaits in the physics engine, stored next to the records."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from compare.study.record import RunRecord, load_gait
from compare.study.store import FOLDER as STORE
from compare.study.store import MISSING, Store
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, make_file_name
from nlp_gait.progress import ignore_progress
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import load_mujoco
from nlp_gait.simulation.measurements import measure, measure_walk
from nlp_gait.simulation.mjcf import make_plan_model
from nlp_gait.simulation.plan import Plan, make_plan
from nlp_gait.simulation.simulate import simulate_plan

STEPS = 10  # of a cycle
DEFAULT_DRIVE = Drive()
REMEDY = "delete it and rerun with --engine"


@dataclass(frozen=True, kw_only=True)
class SimulatedGait:
    """A gait in the engine and in the model."""

    problem: str  #: label, as in the record
    solver: str
    run: int
    drive: Drive
    steps: int | None  #: of a cycle; None for a phase
    #: W, mean power over a phase, or J/m, energy of a cycle for each planned metre; mechanical and heat
    unit: Literal["W", "J/m"]
    model: float  #: value of the model
    engine: float | None  #: value of the engine; None after a fall
    fell_at_s: float | None  #: time of the fall; None if there was none
    walked_share: float | None  #: walked share of the planned distance; None for a phase and after a fall


@dataclass(frozen=True, kw_only=True)
class _Stored:
    simulated: str  # hash of model and motion, and the version of the engine
    gait: SimulatedGait


def simulate_records(
    folder: Path, records: Sequence[RunRecord], drive: Drive, progress: Callable[[str], None] | None = None
) -> list[SimulatedGait]:
    """Simulate the gaits of records whose problem can be simulated, a cycle for ten steps; progress receives each gait.

    A stored gait is simulated again only if its gait, drive, robot or engine have changed.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        OutputError: the folder is not writable.
    """
    version = f"mujoco {load_mujoco().__version__}"
    store = Store(folder, ignore_progress)
    gaits = []
    for record in records:
        result = load_gait(record)
        if (model := result.problem.display.simulation_model) is not None:
            steps = STEPS if model.repeats else None
            plan = make_plan(result, steps)
            simulated = f"{_hash_plan(plan, drive)}, {version}"
            name, inputs = _name(record), _list_inputs(record, drive)
            stored = store.load(name, inputs)
            if stored is MISSING or stored.get("simulated") != simulated:
                gait = _simulate(record, plan, steps, drive)
                stored = store.save(name, inputs, asdict(_Stored(simulated=simulated, gait=gait)))
            gaits.append(decode(_Stored, stored).gait)
        if progress is not None:
            progress(f"{record.problem} {record.solver}")
    return gaits


def load_simulations(folder: Path, records: Sequence[RunRecord], drive: Drive = DEFAULT_DRIVE) -> list[SimulatedGait]:
    """Return the stored simulations of records, without MuJoCo; raises InputError for a damaged file."""
    if not (folder / STORE).is_dir():
        return []
    store, gaits = Store(folder), []
    for record in records:
        stored = store.load(_name(record), _list_inputs(record, drive))
        if stored is not MISSING:
            with convert_errors(f"simulation {_name(record)!r} in {str(folder)!r} is damaged", InputError, REMEDY):
                gaits.append(decode(_Stored, stored).gait)
    return gaits


def _simulate(record: RunRecord, plan: Plan, steps: int | None, drive: Drive) -> SimulatedGait:
    trace = simulate_plan(plan, drive=drive)
    if steps is None:
        measured, share = measure(plan, trace, drive), None
        model, engine = measured.predicted.total_W, None if measured.fallen else measured.measured.total_W
    else:
        walk = measure_walk(plan, trace, drive, steps)
        model, engine = walk.model_J_per_m, walk.engine_J_per_planned_m
        share = None if walk.walked_m is None else walk.walked_m / walk.planned_m
    return SimulatedGait(
        problem=record.problem,
        solver=record.solver,
        run=record.run,
        drive=drive,
        steps=steps,
        unit="W" if steps is None else "J/m",
        model=model,
        engine=engine,
        fell_at_s=trace.fell_at_s,
        walked_share=share,
    )


def _name(record: RunRecord) -> str:
    return f"simulations/{make_file_name(record.problem)}/{make_file_name(record.solver)}-{record.run}"


def _list_inputs(record: RunRecord, drive: Drive) -> dict[str, Any]:
    return {"problem": record.inputs.problem, "x": dict(record.x), "drive": asdict(drive)}


def _hash_plan(plan: Plan, drive: Drive) -> str:
    """Hash of the simulated model and motion; the set-points follow from these and the drive."""
    digest = hashlib.sha256(make_plan_model(plan, drive).encode())
    for name in ("t", "q", "tau"):
        digest.update(plan.signals.arrays[name].tobytes())
    return digest.hexdigest()
