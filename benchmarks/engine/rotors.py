"""Effect of the inertia of the motors' rotors on a walk, planned without it and with it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.engine.agreement import STEPS
from benchmarks.engine.gaits import optimal_cycles
from benchmarks.engine.markdown import cells, header
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import measure_walk
from nlp_gait.simulation.plan import Plan, make_plan
from nlp_gait.simulation.simulate import simulate_plan

SPEEDS = (0.05, 0.1)  # [m/s]


def rotors() -> Iterator[str]:
    """Cheapest cycles planned without and with rotors, in an engine without and with them: J per planned metre."""
    yield header("planned", "m/s", "single support s", "model", "engine without rotors", "engine with rotors")
    for label, options in (("without rotors", {}), ("with rotors", {"motors": "rotor"})):
        for speed, result in optimal_cycles(SPEEDS, **options).items():
            plan = make_plan(result, STEPS)
            heavy = optimal_cycles(SPEEDS, motors="rotor")[speed].problem.display.simulation_model
            assert heavy is not None  # a cycle has one; for the type checker
            model, light = energies(plan, {})
            _, heavier = energies(plan, dict(heavy.robot.armatures_kgm2))
            single = result.x[result.problem.variable_index("single_support_time_s")]
            yield cells(label, f"{speed:g}", f"{single:.3f}", model, light, heavier)


def energies(plan: Plan, armatures_kgm2: dict[str, float]) -> tuple[str, str]:
    """Format the energies of the model and of the engine with these rotors [J per planned metre]."""
    simulated = replace(plan, robot=replace(plan.robot, armatures_kgm2=armatures_kgm2))
    walk = measure_walk(simulated, simulate_plan(simulated), Drive(), STEPS)
    energy = walk.engine_J_per_planned_m
    return f"{walk.model_J_per_m:.2f}", "falls" if energy is None else f"{energy:.2f}"
