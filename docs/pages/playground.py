"""The playground: a page of its own with the objective of an instance as WebAssembly, live gaits, and searches that race.

The objective is the C++ of ``export_objective``. The gait is computed by the same symbolic model in the page, too: positions of
joints, centre of mass, zero-moment point and power of an instant, as a function of the variables, compiled into the same module.
"""

from __future__ import annotations

import base64
import tempfile
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from docs.pages.markdown import page, write_all
from docs.pages.webassembly import REMEDY, compile_module, has_compiler
from nlp_gait.backends.kernel.compiler import write_rows_source
from nlp_gait.formulation import InstantPoint
from nlp_gait.gaitbench import load
from nlp_gait.gaitbench.c_export import export_objective, make_prefix
from nlp_gait.gaitbench.instance import Instance
from nlp_gait.gaits.biped.body import Support
from nlp_gait.gaits.biped.limits import GOALS, REACH_MARGIN
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import ON_GROUND, list_limbs, make_level_sole, place_links
from nlp_gait.gaits.biped.problems import GridOptions
from nlp_gait.gaits.biped.samples import BOTH_FEET
from nlp_gait.gaits.biped.support_phases import make_support_phase
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics
from nlp_gait.symbolic.nonsmooth import Exact
from nlp_gait.symbolic.tape import simplify

ID = "ssp-v5"
FRAMES = 61  # of a gait; the page interpolates between them
SOURCES = Path(__file__).parents[1] / "playground"
FOLDER, PAGE = "site", "playground.html"  # copied to the root of the site
VARIABLES = {
    "hip_height_m": "height of the hip at both ends",
    "hip_vz_start_m_s": "hip, speed upwards at the start",
    "hip_vz_end_m_s": "hip, speed upwards at the end",
    "hip_vx_start_m_s": "hip, speed forwards at the start",
    "hip_vx_end_m_s": "hip, speed forwards at the end",
    "hip_vy_start_m_s": "hip, speed to the left at the start",
    "hip_vy_end_m_s": "hip, speed to the left at the end",
    "swing_height_m": "highest point of the swinging foot",
    "single_support_time_s": "time from lift-off to touch-down",
}
FAMILIES = {
    "torque_change": "change of a torque over a tenth of the step",
    "joint_angle": "angles of the joints",
    "reach": "knees not stretched (cosine)",
    "dbm_x": "balance margin along the foot",
    "dbm_y": "balance margin across the foot",
    "dbm_x_mean": "mean margin along the foot",
    "dbm_y_mean": "mean margin across the foot",
}


def write(folder: Path) -> None:
    """Write the page that leads to the playground."""
    write_all(folder / "playground", {"index.md": introduce(load(ID), left_out=not has_compiler())})


def write_playground(folder: Path) -> None:
    """Write the playground where it can be compiled."""
    path = folder / FOLDER / PAGE
    path.parent.mkdir(parents=True, exist_ok=True)
    if has_compiler():
        path.write_text(make_page(), encoding="utf-8")
    else:
        path.unlink(missing_ok=True)
        print(f"the playground is left out: {REMEDY}", flush=True)


def introduce(instance: Instance, *, left_out: bool) -> str:
    """Return the page of the documentation that leads to the playground."""
    link = f'<a class="reference external" href="../../{PAGE}"><strong>Open the playground</strong></a>'
    return page(
        "# Try it in the browser",
        f"Move {len(instance.names)} sliders and see the step of a robot change, with its power and its balance margin. Then let "
        "PSO, GA and ACO race in the page, with the optimum as the mark to beat. Nothing is installed, nothing is sent.",
        f"This build is without the playground: {REMEDY}." if left_out else link,
        f"The page is one file. It contains instance `{ID}` of [GaitBench](../../gaitbench.md) as WebAssembly, from the C++ "
        f"that `nlp-gait export {ID} --to objective --out DIR` writes: {len(instance.row_names)} constraints and the objective, "
        "which equal those of Python to nine digits (`tests/docs/test_playground.py`). The gait, the ZMP and the power "
        "that are drawn come from the same symbolic model and are computed in the page, too. The searches have the settings of "
        "[those of the package](../algorithms.md).",
    )


def make_page() -> str:
    """Return the page, which needs no other file."""
    instance = load(ID)
    frames = write_frames(make_phase(instance))
    facts = describe_instance(instance) | {"gait": frames.facts}
    folders = [str(SOURCES), str(files("compare.report") / "templates")]
    environment = Environment(loader=FileSystemLoader(folders), autoescape=True, undefined=StrictUndefined)
    module = base64.b64encode(compile_instance(instance, frames.function)).decode()
    return environment.get_template("playground.html.j2").render(facts=facts, module=module)


def compile_instance(instance: Instance, frame: ca.Function) -> bytes:
    """Return the module with the objective and with the frames of a gait."""
    with tempfile.TemporaryDirectory() as folder:
        objective, *_ = export_objective(instance, Path(folder))
        gait = Path(folder) / "gait.cpp"
        gait.write_text(write_rows_source(frame), encoding="utf-8")
        exports = (f"{make_prefix(instance.id)}_evaluate", "nlp_gait_evaluate_rows", "nlp_gait_rows_memory", "malloc")
        return compile_module([objective, gait], exports)


def describe_instance(instance: Instance) -> dict[str, Any]:
    """Return what the page says about an instance; its rows are in the order of the exported C++."""
    problem = instance.gait_problem
    variables = [
        {"name": v.name, "words": VARIABLES[v.name], "unit": v.unit, "lower": lower, "upper": upper}
        for v, lower, upper in zip(problem.variables, instance.lower.tolist(), instance.upper.tolist(), strict=True)
    ]
    constraints = problem.assemble(problem.symbols(), Exact()).constraints
    return {
        "id": instance.id,
        "source": instance.definition.source,
        "prefix": make_prefix(instance.id),
        "variables": variables,
        "rows": instance.row_names,
        "families": [
            {"name": c.name, "words": FAMILIES[c.name], "unit": c.unit, "scale": c.scale} for c in constraints
        ],
        "optimum": {
            "x": instance.best_x.tolist(),
            "power": instance.best_known,
            "evidence": str(instance.evidence),
        },
    }


def make_phase(instance: Instance) -> Phase:
    """Return the phase of an instance of single support with cubics."""
    options = instance.definition.options
    body = make_nao(str(options["robot"]))
    step_m, grid = float(options["step_length_m"]), GridOptions().make_grid()
    return make_support_phase(body, Support.SINGLE, step_m, "cubic", grid, GOALS["power"])


@dataclass(frozen=True, kw_only=True)
class Frames:
    """A gait, frame by frame."""

    #: From x and the phase in [0, 1] to the points of all lines of the stick figure, those under both ankles and the centre of
    #: mass, (3,) each, then the zero-moment point (2,) [m] and the joints' mechanical power [W]
    function: ca.Function
    facts: dict[str, Any]  #: what the page needs to read them


def write_frames(phase: Phase) -> Frames:
    """Return the frames of a phase, computed by the symbols of its problem."""
    body, names = phase.body, phase.names
    x, s = SX.sym("x", len(names)), SX.sym("s")
    margin = next(parameter.default for parameter in phase.parameters if parameter.name == REACH_MARGIN)
    now = phase.loads(phase.plan(InstantPoint.of(x, SX(margin), names, [REACH_MARGIN]), s, Exact()))
    angles = {name: joint.position for name, joint in now.joints.items()}
    soles = {
        side: now.ankles[letter] - SX([0, 0, body.robot.feet[side].ankle_height_m])
        for letter, side in BOTH_FEET.items()
    }
    places = place_links(body.full, angles, now.ankles["L"]) | {f"{side}_foot": sole for side, sole in soles.items()}
    lines = list_limbs(body.full)
    tree = make_tree(body.robot, body.robot.feet["left"].link)
    com = centre_of_mass(tree, forward_kinematics(tree, angles, now.ankles["L"]))
    power = sum((ca.fabs(now.joints[name].velocity * now.torques[name]) for name in body.joints), SX(0))
    points = [places[name] for _, line in lines for name in line]
    frame = ca.vertcat(*points, *soles.values(), com, now.zmp, power)
    feet = {side: make_level_sole(body.full, side, np.zeros((1, 3))) for side in soles}
    facts = {
        "frames": FRAMES,
        "columns": frame.numel(),
        "duration": names.index(phase.duration),
        "on_ground_mm": 1000.0 * ON_GROUND,
        "lines": [{"side": side, "count": len(line)} for side, line in lines],
        "feet": [{"side": side, "outline": sole.corners[0].tolist()} for side, sole in feet.items()],
    }
    return Frames(function=ca.Function("kernel", [x, s], [ca.densify(*simplify([frame]))]), facts=facts)
