"""What the page of Gupta, Pratihar, Deb (2023) shows: Tables 6 to 9 next to ours, and what stays unexplained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from compare.drawing.figures import COLOURS, make_axes
from compare.papers.nao.results import (
    FOLDER,
    INDEXES,
    KINDS,
    MARGINS,
    PHASES,
    PRINTED,
    PRINTED_X,
    READINGS,
    SEARCHES,
    SHARES,
    NaoResults,
    make_spec,
)
from compare.papers.paper import read_rows
from compare.papers.paper_runs import evaluate_point, tabulate
from compare.report.document import Figure, Part, Prose, Section, Table, Value

JOINTS = ("HipYawPitch", "Hip", "Knee", "Ankle")


def list_margins(result: NaoResults, phase: str, indexes: Sequence[str] = MARGINS) -> list[float]:
    """Return margins of both printed solutions [mm]."""
    return [1000 * result.measure(phase, search)[index] for search in SEARCHES for index in indexes]


def list_errors(result: NaoResults, phase: str, indexes: Sequence[str] = MARGINS) -> list[float]:
    """Return the margins of the printed solutions here, less the printed ones [mm]."""
    printed = [1000 * PRINTED[phase, search][index] for search in SEARCHES for index in indexes]
    return list(np.subtract(list_margins(result, phase, indexes), printed))


def list_levels(result: NaoResults, phase: str, kind: str) -> list[float]:
    """Return the power [W] or the torque change [Nm] of both printed solutions."""
    return [result.measure(phase, search)[KINDS[kind]] for search in SEARCHES]


def compute_powers(
    result: NaoResults, search: str = "PSO", **changes: float
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the mean mechanical power and the mean heat of each joint in single support [W]."""
    signals, problem = result.sample("ssp", search, **changes), make_spec("ssp", result.reading).load()
    t, tau, qd = (signals.arrays[name] for name in ("t", "tau", "qd"))
    parts = np.abs(tau * qd), problem.value("heat_loss_W_per_Nm2") * tau**2
    mechanical, heat = (np.trapezoid(power, t, axis=0) / (t[-1] - t[0]) for power in parts)
    return dict(zip(signals.joints, mechanical, strict=True)), dict(zip(signals.joints, heat, strict=True))


def show(results: Mapping[str, NaoResults]) -> list[Part]:
    """Return what stays unexplained, Tables 6 to 9 next to ours in both readings, and causes that are refuted."""
    causes = (
        "A cause has to give the printed row. The print refutes a wrong time step, and mechanical power of the legs that counts "
        "more than once. A constant, the arms and the heat of the legs would fit, but nothing in the text calls for them.",
        tabulate_causes(results["printed"]),
    )
    return [
        Prose(explain(results["printed"])),
        *(tabulate_phase(results, phase) for phase in PHASES),
        tabulate_swings(results["printed"]),
        tabulate_shares(results["printed"]),
        draw(results),
        Section(title="Causes of the missing power, against the print", parts=causes, folded=True),
    ]


def explain(result: NaoResults) -> str:
    """Return what stays unexplained."""
    missing = [PRINTED["ssp", s]["power_W"] - result.measure("ssp", s)["power_W"] for s in SEARCHES]
    torques = [list_levels(result, "dsp", "torque"), [PRINTED["dsp", s]["torque_change_Nm"] for s in SEARCHES]]
    here, printed = (" / ".join(f"{value:.3f}" for value in values) for values in torques)
    means = list_errors(result, "dsp")[2:4]
    return (
        f"**Unexplained.** Power of single support is {missing[0]:.3f} W (PSO) and {missing[1]:.3f} W (GA) below the print, "
        "nearly a constant, which touches no optimum or ranking. Torque change of double support is "
        f"{here} Nm (PSO / GA) for {printed} Nm in print; its mean margins differ by {means[0]:+.1f} and {means[1]:+.1f} mm (x, "
        "y). Its level of power depends on who carries the arms, which is not printed."
    )


def tabulate_phase(results: Mapping[str, NaoResults], phase: str) -> Table:
    """Return variables and figures of a phase: printed, of the printed solutions here, and of IPOPT's optima."""
    names, columns = make_spec(phase, "physical").load().names, dict[str, Mapping[str, float]]()
    for search in SEARCHES:
        x = PRINTED_X[phase, search]
        columns[f"{search}, paper"] = {**dict(zip(names, x, strict=True)), **PRINTED[phase, search]}
        for reading in READINGS:
            columns[f"{search}, {reading} reading"] = results[reading].measure(phase, search)
        for robot in ("v4", "v6"):
            spec = make_spec(phase, "printed", robot=f"nao-{robot}")
            columns[f"{search}, printed reading, {robot.upper()}"] = evaluate_point(spec, x)
    for reading in READINGS:
        best = results[reading].best(make_spec(phase, reading))
        columns[f"IPOPT, {reading} reading"] = {**best.x, **best.metrics}
    rows = [{"": name, **{title: c.get(name) for title, c in columns.items()}} for name in (*names, *INDEXES)]
    numbers = {"ssp": (6, 7), "dsp": (8, 9)}[phase]
    caption = f"Tables {numbers[0]} and {numbers[1]}, {PHASES[phase]}: variables, and figures of the same gait"
    return tabulate(f"table{numbers[1]}", caption, rows)


def tabulate_swings(result: NaoResults) -> Table:
    """Return the printed powers over the swing height next to those of the printed solutions raised."""
    rows = []
    for row in read_rows(FOLDER / "swing_heights.csv"):
        height, printed = float(row["swing_height_m"]), {search: float(row[f"{search}_W"]) for search in SEARCHES}
        here = {search: result.measure("ssp", search, swing_height_m=height)["power_W"] for search in SEARCHES}
        paper = {f"{search}, paper [W]": value for search, value in printed.items()}
        ours = {f"{search}'s solution [W]": value for search, value in here.items()}
        missing = {f"{search} missing [W]": value - here[search] for search, value in printed.items()}
        rows.append({"swing height [m]": height, **paper, **ours, **missing})
    return tabulate("table7-swing-heights", "Table 7, rows 6 to 11; the printed solutions raised", rows)


def tabulate_shares(result: NaoResults) -> Table:
    """Return PSO's printed double support against the optimum, by share of the torso and who carries the arms."""
    rows = []
    for share, arms in SHARES:
        spec = make_spec("dsp", "printed", f"-{share}-{arms}", torso_share=share, arms=arms)
        power, best = evaluate_point(spec, PRINTED_X["dsp", "PSO"])["power_W"], result.best(spec)
        excess = 100 * (power / best.objective - 1) if best.feasible else None
        words = {"share of the torso": share, "arms": arms}
        rows.append({**words, "PSO's solution [W]": power, "above the optimum [%]": excess})
    caption = "Double support: hip and time of the print, mean y margin at least that of the printed solution"
    return tabulate("shares", caption, rows)


def tabulate_causes(result: NaoResults) -> Table:
    """Return what each supposed cause of the missing power of single support gives, next to the print."""
    swings = {float(row["swing_height_m"]): float(row["PSO_W"]) for row in read_rows(FOLDER / "swing_heights.csv")}
    gaits = {"PSO": ("PSO", 0.015), "GA": ("GA", 0.015), "0.018": ("PSO", 0.018), "0.022": ("PSO", 0.022)}
    drawn = {name: compute_powers(result, search, swing_height_m=height) for name, (search, height) in gaits.items()}
    printed = {"PSO": swings[0.015], "GA": PRINTED["ssp", "GA"]["power_W"]}
    printed |= {name: swings[float(name)] for name in ("0.018", "0.022")}
    rows = list[Mapping[str, Value]]()
    for cause in [{"cause": "printed"}, *read_rows(FOLDER / "causes.csv")]:
        powers = printed
        if cause["cause"] != "printed":
            powers = {name: _weigh(cause, *parts) for name, parts in drawn.items()}
        excess = {name: 1000 * (power - powers["PSO"]) for name, power in powers.items() if name != "PSO"}
        titles = {"GA": "GA more than PSO [mW]", "0.018": "swing height 18 mm [mW]", "0.022": "swing height 22 mm [mW]"}
        rows.append({"cause": cause["cause"], "PSO [W]": powers["PSO"], **{titles[n]: v for n, v in excess.items()}})
    return tabulate("causes", "", rows)


def _weigh(cause: Mapping[str, str], mechanical: Mapping[str, float], heat: Mapping[str, float]) -> float:
    total = 0.0
    for joint, power in mechanical.items():
        leg = any(joint[1:].startswith(kind) for kind in JOINTS)
        group = ("support" if joint[0] == "L" else "swing") if leg else "arms"
        total += float(cause[group]) * power + float(cause["leg_heat" if leg else "arm_heat"]) * heat[joint]
    return total


def draw(results: Mapping[str, NaoResults]) -> Figure:
    """Return the errors of all printed margins in both readings."""
    figure, axes = make_axes(6.0, 3.0)
    for (reading, colour), offset in zip((("printed", "ga"), ("physical", "pso")), (-0.2, 0.2), strict=True):
        errors = [error for phase in PHASES for error in list_errors(results[reading], phase)]
        axes.bar(np.arange(len(errors)) + offset, errors, 0.4, color=COLOURS[colour], label=f"{reading} reading")
    kinds = [f"{'least' if 'min' in index else 'mean'} {index[4]}" for index in MARGINS]
    labels = [f"{phase} {search}\n{kind}" for phase in PHASES for search in SEARCHES for kind in kinds]
    axes.set_xticks(range(len(labels)), labels, rotation=90, fontsize="x-small")
    axes.set(ylabel="error of the margin [mm]")
    axes.legend()
    caption = "Margins of the printed solutions here, less the printed ones"
    return Figure(name="margins", caption=caption, drawing=figure)
