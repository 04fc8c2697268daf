"""Phases of a longer motion, a cycle or a walk: parameters, rows and indexes named by phase, times one after the other."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from casadi import MX

from nlp_gait.formulation import Assembly, Objective, Parameter, Point, RowsOverTime, Signals
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.symbolic.nonsmooth import Nonsmooth

ENERGY_PER_METRE = Objective(name="energy_per_metre", unit="J/m")
STAND = "stand"
KINDS = {"ssp": "SSP", "dsp": "DSP", STAND: "feet side by side"}  # of phases, in words
# Limits that differ between the kinds of phases; their names begin with the kind.
BALANCE = tuple(f"dbm_{axis}_{kind}_limit_m" for kind in ("min", "mean") for axis in "xy")


def collect_parameters(phases: Mapping[str, Phase]) -> list[Parameter]:
    """Return the parameters of phases by kind, each once; the names of those of balance begin with the kind."""
    found: dict[str, Parameter] = {}
    for kind, phase in phases.items():
        for parameter in phase.parameters:
            if parameter.name in BALANCE:
                text = f"{parameter.description}, {KINDS[kind]}"
                parameter = replace(parameter, name=f"{kind}_{parameter.name}", description=text)
            found.setdefault(parameter.name, parameter)
    return list(found.values())


def assemble_part(name: str, kind: str, phase: Phase, at: Point, samples: Samples, ops: Nonsmooth) -> Assembly:
    """Assemble one phase of a kind, with its name before those of its rows and indexes."""
    limits = {limit: at.positions[f"{kind}_{limit}"] for limit in BALANCE}  # a phase reads them under their plain names
    part = phase.assemble(replace(at, positions={**at.positions, **limits}), ops, samples)
    return Assembly(
        objective=part.objective,
        constraints=tuple(replace(row, name=f"{name}_{row.name}") for row in part.constraints),
        indexes={f"{name}_{key}": value for key, value in part.indexes.items()},
    )


def list_rows_over_time(
    parts: Iterable[tuple[str, str, str, int]], phases: Mapping[str, Phase], read: Callable[[str, Point], Point]
) -> tuple[RowsOverTime, ...]:
    """Return each part of a motion as functions of time, where it occurs first.

    Parts are names, kinds of ``phases``, variables that hold the durations, and how often each occurs; ``read`` returns the point
    of a part.
    """

    def assemble(name: str, kind: str, at: Point, instants: MX, ops: Nonsmooth) -> Assembly:
        point = read(name, at)
        return assemble_part(name, kind, phases[kind], point, phases[kind].sample(point, ops, instants), ops)

    found: list[RowsOverTime] = []
    begins: tuple[str, ...] = ()
    for name, kind, duration, count in parts:
        for rows in replace(phases[kind], duration=duration).rows_over_time(name, begins) if count else ():
            means = tuple(f"{name}_{index}" for index in rows.means)
            found.append(replace(rows, assemble=partial(assemble, name, kind), means=means))
        begins = (*begins, *[duration] * count)
    return tuple(found)


def join_phases(phases: Iterable[Signals]) -> Signals:
    """Join phases that begin at time zero; of both samples at a switch, equal in positions and rates, the earlier one is kept."""
    first, *others = phases
    arrays = {name: [array] for name, array in first.arrays.items()}
    for other in others:
        begin = arrays["t"][-1][-1]
        for name, array in other.arrays.items():
            arrays[name].append((begin + array if name == "t" else array)[1:])
    return replace(first, arrays={name: np.concatenate(parts) for name, parts in arrays.items()})
