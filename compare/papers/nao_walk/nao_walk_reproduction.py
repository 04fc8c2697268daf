"""Claims of others about NAO's walk: runs, verdicts and a report."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Any

from compare.analysis.units import join_words
from compare.drawing.figures import COLOURS, make_axes, make_figure
from compare.papers.claims import bind_checks
from compare.papers.nao_walk import nao_walk_claims
from compare.papers.nao_walk import nao_walk_runs as runs
from compare.papers.nao_walk.nao_walk_claims import HEATS, NaoWalkFindings
from compare.papers.nao_walk.nao_walk_runs import KINDS, SPECS, SPEED_M_S, NaoWalkEffort, sum_energy
from compare.papers.paper_runs import Runner
from compare.papers.reproduction import Reproduction
from compare.report.document import Rows, Value
from nlp_gait.errors import InputError
from nlp_gait.gaits.biped import cart_table, recorded_cycle
from nlp_gait.simulation import drive, simulate
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.engine import load_mujoco

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _run_nao_walk(runner: Runner, effort: NaoWalkEffort) -> NaoWalkFindings:
    """Compute optimal gaits, then simulate them and the robot's own walk."""
    load_mujoco()  # fail before the work if it is missing
    code = (runs, cart_table, recorded_cycle, drive, simulate)
    gaits = runner.compute(runs.make_gait_computations(effort), code)
    speeds = {heat: gaits[f"speeds-{heat}"] for heat in SPECS}
    optima = {}
    for heat, points in speeds.items():
        at = next(point for point in points if point["speed_m_s"] == SPEED_M_S)
        if not at["feasible"]:
            raise InputError(f"no optimal gait was found at {SPEED_M_S:g} m/s with K of the {heat}; use more starts")
        optima[heat] = at["x"]
    walks = runner.compute(runs.make_walk_computations(effort, optima), code)
    return NaoWalkFindings(
        effort=effort,
        speeds=speeds,
        torsos=gaits["torsos"],
        straighter=_select(gaits, "straighter-"),
        joints=_select(walks, "joints-"),
        drives={name: list(_select(walks, f"drives-{name}-").values()) for name in runs.FEED_FORWARD},
    )


def _select(results: dict[str, Any], prefix: str) -> dict[str, Any]:
    """Results whose names begin with a prefix, by the rest of the name, in their order."""
    return {name.removeprefix(prefix): result for name, result in results.items() if name.startswith(prefix)}


def _compute_values(findings: NaoWalkFindings) -> dict[str, Any]:
    effort = findings.effort
    disturbances = {"pushes": runs.PUSHES_NS, "slopes": runs.SLOPES_DEG}
    disturbances |= {"frictions": runs.FRICTIONS, "masses": runs.MASS_FACTORS}
    straighter = {"paper": next(iter(findings.straighter.values())), "sheet": findings.straighter["sheet"]}
    return {
        "knees": {name: found["free"]["knee_deg"] for name, found in straighter.items()},
        "step_mm": 1000 * runs.STEP_M,
        "period_s": runs.make_footsteps().period_s,
        "speed_cm_s": 100 * SPEED_M_S,
        "torso_mm": 1000 * runs.TORSO_M,
        "lift_mm": 1000 * runs.LIFT_M,
        "stretched_mm": 1000 * runs.STRETCHED_M,
        "full_error": Drive().full_error_rad,
        **{name: join_words(f"{value:g}" for value in values) for name, values in disturbances.items()},
        "lengths": join_words(f"{1000 * length:.0f}" for length in effort.steps_m),
    }


NAMES = {
    "own": "own walk",
    "own-plain": "own walk, plain drives",
    "optimum-paper": "optimum for K of the paper",
    "optimum-sheet": "optimum for K of the data sheet",
}


def _make_tables(findings: NaoWalkFindings) -> dict[str, Rows]:
    drives = [
        [name, share, point["walked_share"], point["sheet_J_per_m"], point["paper_J_per_m"], point["tracking_rad"]]
        + [point["falls"], point["disturbances"], 100 * point["fastest_m_s"]]
        for name, points in findings.drives.items()
        for share, point in zip(findings.effort.stiffnesses, points, strict=True)
    ]
    speeds = [
        [HEATS[heat], 100 * point["speed_m_s"], "yes" if point["feasible"] else "no"]
        + [point["cost_of_transport"], point["energy_J_per_m"]]
        for heat, points in findings.speeds.items()
        for point in points
    ]
    energies = ("paper_J_per_m", "sheet_J_per_m")
    torsos = [[1000 * at["torso_m"], at["knee_deg"], *(at[key] for key in energies)] for at in findings.torsos]
    straighter: list[list[Value]] = []
    for heat, at in findings.straighter.items():
        ends = ([1000 * end["hip_m"], end["knee_deg"], end["power_W"]] for end in (at["free"], at["paper"]))
        straighter.append([HEATS.get(heat, heat), *chain(*ends)])
    joints = _list_joints(findings)
    return {"joints": joints, "torsos": torsos, "straighter": straighter, "drives": drives, "speeds": speeds}


def _list_joints(findings: NaoWalkFindings) -> Rows:
    """Shares of each kind of joint; the engine has no numbers of a walk that fell."""
    rows: list[list[Value]] = []
    for gait, found in findings.joints.items():
        for where in ("model",) if found["fell_at_s"] is not None else ("model", "engine"):
            for heat in SPECS:
                shares = [100 * findings.share(gait, where, heat, kind) for kind in KINDS]
                rows.append([NAMES[gait], where, HEATS[heat], *shares, sum_energy(found[where].values(), heat)])
    return rows


BARS = (  # gait, where, label
    ("own", "model", "own walk,\nmodel"),
    ("own", "engine", "own walk,\nengine"),
    ("own-plain", "engine", "plain drives,\nengine"),
    ("optimum-sheet", "model", "optimum,\nmodel"),
    ("optimum-sheet", "engine", "optimum,\nengine"),
)
PALETTE = ("#D55E00", "#0072B2", "#56B4E9", "#009E73", "#E69F00", "#CC79A7", "#999999")


def draw_figures(findings: NaoWalkFindings) -> dict[str, Figure]:
    """Return the figures by name."""
    return {"joints": _draw_joints(findings), "speeds": _draw_speeds(findings), "drives": _draw_drives(findings)}


def _draw_joints(findings: NaoWalkFindings) -> Figure:
    """Energy by kind of joint; full colour is heat, pale is mechanical."""
    figure, axes = make_axes(6.3, 3.4)
    for place, (gait, where, _) in enumerate(BARS):
        bottom = 0.0
        for kind, colour in zip(KINDS, PALETTE, strict=True):
            sheet, mechanical = (findings.joints[gait][where][kind][part] for part in ("sheet", "mechanical"))
            axes.bar(place, sheet, 0.7, bottom, color=colour, label=None if place else KINDS[kind])
            axes.bar(place, mechanical, 0.7, bottom + sheet, color=colour, alpha=0.45)
            bottom += sheet + mechanical
    axes.set_axisbelow(True)
    axes.set_xticks(range(len(BARS)), [label for *_, label in BARS])
    axes.set_ylabel("energy [J/m]")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), reverse=True)
    return figure


def _draw_speeds(findings: NaoWalkFindings) -> Figure:
    figure, axes = make_axes(4.6, 3.0)
    for heat, name, colour in (("paper", "paper", COLOURS["pso"]), ("sheet", "data sheet", COLOURS["ga"])):
        curve = findings.curve(heat)
        speeds, costs = [100.0 * at["speed_m_s"] for at in curve], [at["cost_of_transport"] for at in curve]
        axes.plot(speeds, costs, "o-", color=colour, label=f"optimum, K of the {name}")
    axes.axvline(100.0 * SPEED_M_S, color="#808080", ls="--", label="default speed")
    axes.set(xlabel="speed [cm/s]", ylabel="cost of transport P / (m g v)")
    axes.set_ylim(bottom=0.0)
    axes.legend()
    return figure


def _draw_drives(findings: NaoWalkFindings) -> Figure:
    figure = make_figure(6.3, 2.8)
    energy, falls, speed = figure.subplots(1, 3)
    shares = findings.effort.stiffnesses
    for name, label, colour in (("none", "plain", COLOURS["ga"]), ("torque", "torque fed forward", COLOURS["pso"])):
        points = findings.drives[name]
        up = [(share, point["sheet_J_per_m"]) for share, point in zip(shares, points, strict=True) if not point["fell"]]
        if up:
            energy.plot(*zip(*up, strict=True), "o-", color=colour, label=label)
        falls.plot(shares, [point["falls"] for point in points], "o-", color=colour)
        speed.plot(shares, [100.0 * point["fastest_m_s"] for point in points], "o-", color=colour)
    energy.set_ylabel("energy [J/m]")
    falls.set_ylabel(f"falls of {findings.drives['none'][0]['disturbances']}")
    speed.set_ylabel("fastest walk [cm/s]")
    for axes in (energy, falls, speed):
        axes.set_ylim(0.0, 1.05 * axes.dataLim.y1 or 1.0)
        axes.set_xlabel("stiffness, share of full")
    energy.legend()
    return figure


REPRODUCTION = Reproduction(
    name="nao_walk",
    full=NaoWalkEffort(),
    run=_run_nao_walk,
    values=_compute_values,
    tables=_make_tables,
    figures=draw_figures,
    checks=bind_checks("nao_walk/nao_walk_claims.toml", vars(nao_walk_claims)),
)
