"""What the page of Gupta, Pratihar, Deb (2023) shows: Tables 6 to 9 next to ours, and what stays unexplained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from compare.papers.nao.figures import draw_figures, draw_gait
from compare.papers.nao.results import (
    FOLDER,
    INDEXES,
    KINDS,
    MARGINS,
    PHASES,
    PHYSICAL,
    PRINTED,
    PRINTED_OPTIONS,
    PRINTED_X,
    RECONSTRUCTED,
    SEARCHES,
    NaoResults,
    make_spec,
)
from compare.papers.paper import read_rows
from compare.papers.paper_runs import evaluate_point, tabulate
from compare.report.document import Part, Prose, Section, Table, Value


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
    """Return gaits, figures and Tables 6 to 9 next to ours, and what stays unexplained."""
    result = results[RECONSTRUCTED]
    others = [tabulate_others(results, phase) for phase in PHASES]
    return [
        draw_gait(result),
        Section(title="Figures of the paper, from our computation", parts=draw_figures(results)),
        Section(
            title="Tables 6 to 9", parts=[*(tabulate_phase(result, phase) for phase in PHASES), tabulate_swings(result)]
        ),
        Section(title="How the reading was found, and what stays unexplained", parts=[Prose(explain(results))]),
        Section(title="The printed solutions in the physical reading, and of other robots", parts=others, folded=True),
    ]


def explain(results: Mapping[str, NaoResults]) -> str:
    """Return how the reading was found, and what stays unexplained."""
    result, errors = results[RECONSTRUCTED], dict[str, float]()
    readings: dict[str, Mapping[str, Any]] = {
        "physical gravity and ten intervals": {},
        "ten samples alone": {"intervals": 9},
        "the sign of g alone": {"zmp_gravity": "printed"},
        "both": PRINTED_OPTIONS,
    }
    for words, options in readings.items():
        spec = make_spec("ssp", PHYSICAL, **options)
        points = {search: evaluate_point(spec, PRINTED_X["ssp", search]) for search in SEARCHES}
        errors[words] = max(
            1000 * abs(points[s][index] - PRINTED["ssp", s][index]) for s in SEARCHES for index in MARGINS
        )
    missing = [PRINTED["ssp", s]["power_W"] - result.measure("ssp", s)["power_W"] for s in SEARCHES]
    torques = [list_levels(result, "dsp", "torque"), [PRINTED["dsp", s]["torque_change_Nm"] for s in SEARCHES]]
    here, printed = (" / ".join(f"{value:.3f}" for value in values) for values in torques)
    means = list_errors(result, "dsp")[2:4]
    found = ", ".join(f"{error:.2f} mm ({words})" for words, error in errors.items())
    return (
        "**The reading.** (27) makes g a vector that points down; (19) and (20) subtract a number g, and a cycle is divided into "
        "ten parts, whose samples may be ten or eleven. All four combinations were evaluated at the print; the largest "
        f"error of the eight printed margins of single support is {found}. So the authors computed with ten samples and with "
        "g = +9.8 in the ZMP alone, which turns the sign of its inertial term; their torques have physical gravity. This is a "
        "reconstruction: no reading of the print alone gives it. Its formula is in `docs/model/balance.md`.\n\n"
        f"**Unexplained.** Power of single support is {missing[0]:.3f} W (PSO) and {missing[1]:.3f} W (GA) below the print, "
        "nearly a constant, which touches no optimum or ranking. Torque change of double support is "
        f"{here} Nm (PSO / GA) for {printed} Nm in print; its mean margins differ by {means[0]:+.1f} and {means[1]:+.1f} mm (x, "
        "y). Its level of power depends on who carries the arms, which is not printed."
    )


def tabulate_phase(result: NaoResults, phase: str) -> Table:
    """Return variables and figures of the printed solutions, in print and here, and of IPOPT's optimum."""
    spec = make_spec(phase, result.reading)
    best = result.best(spec)
    values = {**best.x, **best.metrics}
    rows = list[Mapping[str, Value]]()
    for k, name in enumerate(spec.load().names):
        x = {search: PRINTED_X[phase, search][k] for search in SEARCHES}
        printed = {"PSO print": x["PSO"], "PSO here": None, "GA print": x["GA"], "GA here": None}
        rows.append({"": name, **printed, "optimum": values[name]})
    for name in INDEXES:
        pairs: dict[str, Value] = {}
        for search in SEARCHES:
            pairs |= {
                f"{search} print": PRINTED[phase, search][name],
                f"{search} here": result.measure(phase, search)[name],
            }
        rows.append({"": name, **pairs, "optimum": values[name]})
    numbers = {"ssp": (6, 7), "dsp": (8, 9)}[phase]
    return tabulate(f"table{numbers[1]}", f"Tables {numbers[0]} and {numbers[1]}, {PHASES[phase]}", rows)


def tabulate_others(results: Mapping[str, NaoResults], phase: str) -> Table:
    """Return figures of the printed solutions in the physical reading, and of other robots."""
    columns = dict[str, Mapping[str, float]]()
    for search in SEARCHES:
        columns[f"{search}, physical"] = results[PHYSICAL].measure(phase, search)
        for robot in ("v4", "v6"):
            spec = make_spec(phase, RECONSTRUCTED, robot=f"nao-{robot}")
            columns[f"{search}, {robot.upper()}"] = evaluate_point(spec, PRINTED_X[phase, search])
    rows: list[Mapping[str, Value]] = [
        {"": name, **{title: c[name] for title, c in columns.items()}} for name in INDEXES
    ]
    return tabulate(
        f"other-{phase}", f"Printed solutions of {PHASES[phase]}; V4 and V6 in the reconstructed reading", rows
    )


def tabulate_swings(result: NaoResults) -> Table:
    """Return the printed powers over the swing height next to those of the printed solutions raised."""
    rows = []
    for row in read_rows(FOLDER / "swing_heights.csv"):
        height, printed = float(row["swing_height_m"]), {search: float(row[f"{search}_W"]) for search in SEARCHES}
        pairs: dict[str, Value] = {"swing height [m]": height}
        for search, value in printed.items():
            here = result.measure("ssp", search, swing_height_m=height)["power_W"]
            pairs |= {f"{search} print [W]": value, f"{search} here [W]": here}
        rows.append(pairs)
    return tabulate("table7-swing-heights", "Table 7, rows 6 to 11; the printed solutions raised", rows)
