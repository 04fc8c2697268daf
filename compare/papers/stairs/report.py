"""Report of the reproduced stairs paper: the text is ``stairs_report.md``, with every table filled in from the runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from compare.papers.stairs.case_tables import (
    Cases,
    differences_table,
    ideal_table,
    jerk_table,
    learned_table,
    printed_table,
    replay_table,
)
from compare.papers.stairs.paper import TABLE_3, TABLE_4
from compare.papers.stairs.runs import PLAN_EVALUATIONS, TRACK_EVALUATIONS
from compare.papers.tables import Cell, write_table
from nlp_gait.files import write_text
from nlp_gait.problems.stairs.governing import GOVERNING_VARIABLES

MATCH = 1e-3  # a start that ends within this of the best is counted as having found it (relative)


def write_report(folder: Path, cases: Cases, network: Mapping[str, Any], other: Sequence[Mapping[str, Any]]) -> None:
    """Write all tables and ``report.md``."""
    template = (resources.files("compare.papers.stairs") / "report.md").read_text(encoding="utf-8")
    tables = {
        "table_3": _table_3(folder, cases),
        "jerk": jerk_table(folder, cases),
        "plans": _plans(folder, cases),
        "table_4": _table_4(folder, cases),
        "tracks": _tracks(folder, cases),
        "printed": printed_table(folder, cases),
        "ideal": ideal_table(folder, cases),
        "replay": replay_table(folder, cases),
        "other": _other(folder, other),
        "network": _network(folder, network),
        "learned": learned_table(folder, cases),
        "differences": differences_table(folder, cases),
    }
    values = {name: text.strip() for name, text in tables.items()}
    text = template.format(**values, plan_evaluations=PLAN_EVALUATIONS, track_evaluations=TRACK_EVALUATIONS)
    write_text(folder / "report.md", text)


def _table_3(folder: Path, cases: Cases) -> str:
    rows: list[list[Cell]] = []
    for variable in GOVERNING_VARIABLES:
        printed = TABLE_3.get(variable.name)
        values: list[Cell] = [found["plan"]["ipopt"]["x"][variable.name] for found in cases.values()]
        rows.append([variable.name, "-" if printed is None else f"{printed:g}", *values])
    columns = {"parameter": "", "paper": "", **{f"case {case}": ".4f" for case in cases}}
    return write_table(folder / "table3", columns, rows)


def _plans(folder: Path, cases: Cases) -> str:
    columns = {
        "case": "d",
        "solver": "",
        "best [J]": ".3f",
        "all runs [J]": "",
        "feasible": "",
        "dense grid": "",
        "time a run [s]": ".2f",
    }
    rows: list[list[Cell]] = []
    for case, found in cases.items():
        for solver, run in found["plan"].items():
            if solver == "ipopt":
                ends = [start for start in run["starts"] if start["success"]]
                hits = sum(start["objective"] <= run["objective"] * (1 + MATCH) for start in ends)
                every = f"{hits} of {len(run['starts'])} starts, {len(ends)} converged"
                time_s = float(np.mean([start["time_s"] for start in run["starts"]]))
            else:
                every = ", ".join(f"{value:.2f}" for value in run["objectives"])
                time_s = float(np.mean(run["time_s"]))
            rows.append([case, solver, run["objective"], every, *_verdict(run), time_s])
    return write_table(folder / "plans", columns, rows)


def _verdict(run: Mapping[str, Any]) -> list[Cell]:
    """Feasible on the problem's samples, and on the dense grid."""
    worst = run["dense_violations"]
    dense = "feasible" if not worst else f"{worst[0]['name']} by {worst[0]['by']:.1e}"
    return ["yes" if run["feasible"] else "no", dense]


def _table_4(folder: Path, cases: Cases) -> str:
    columns = {
        "quantity": "",
        **{f"paper {case}": ".6g" for case in cases},
        **{f"ours {case}": ".4f" for case in cases},
    }
    best = {case: _best(found["track"]) for case, found in cases.items()}

    def row(name: str, field: str, ours: Mapping[int, float]) -> list[Cell]:
        return [name, *(float(getattr(TABLE_4[case], field)) for case in cases), *(ours[case] for case in cases)]

    def from_best(*path: str) -> dict[int, float]:
        return {case: float(_at(run, path)) for case, run in best.items()}

    rows = [
        row("largest joint acceleration [rad/s^2]", "acceleration", _of(cases, "acceleration")),
        row("largest joint jerk [rad/s^3]", "jerk", _of(cases, "jerk")),
        row("torso pitch [rad]", "torso_pitch_rad", from_best("x", "torso_pitch_rad")),
        row("K_p", "kp", from_best("x", "kp")),
        row("K_d", "kd", from_best("x", "kd")),
        row("cost", "cost", from_best("objective")),
        row("energy (paper: no unit; ours: J)", "energy", from_best("indexes", "energy_J")),
        row("peak torque [N m]", "peak_torque_Nm", from_best("indexes", "peak_torque_Nm")),
    ]
    return write_table(folder / "table4", columns, rows)


def _of(cases: Cases, name: str) -> dict[int, float]:
    return {case: float(found["differences"]["energy"][name]) for case, found in cases.items()}


def _at(run: Mapping[str, Any], path: Sequence[str]) -> Any:
    value: Any = run
    for key in path:
        value = value[key]
    return value


def _best(runs: Mapping[str, Any]) -> Mapping[str, Any]:
    best: Mapping[str, Any] = min(runs.values(), key=lambda run: (not run["feasible"], run["objective"]))
    return best


def _other(folder: Path, other: Sequence[Mapping[str, Any]]) -> str:
    columns = {"tread [m]": ".3f", "rise [m]": ".3f", "plan": "", "ideal": ""}
    rows: list[list[Cell]] = []
    for row in other:
        cells = []
        for name, unit in (("stairs-plan", " J"), ("stairs-ideal", "")):
            run = row[name]
            worst = ", ".join(f"{v['name']} (by {v['by']:.2g} {v['unit']})" for v in run["violations"][:3])
            cells.append(f"{run['objective']:.3f}{unit}" if run["success"] else f"none; in the way: {worst}")
        rows.append([row["tread_m"], row["rise_m"], *cells])
    return write_table(folder / "other-stairs", columns, rows)


def _network(folder: Path, network: Mapping[str, Any]) -> str:
    columns = {
        "rule and rate": "",
        "poses to 1e-6 m^2": "",
        "mean iterations": ".1f",
        "first pose [ms]": ".2f",
        "other poses [ms]": ".3f",
        "largest angle error [rad]": ".4f",
        "mean [rad]": ".4f",
    }
    rows: list[list[Cell]] = [
        [
            rule,
            f"{found['converged']} of {found['poses']}",
            float(np.mean(found["iterations"])),
            1e3 * found["time_s"][0],
            1e3 * float(np.mean(found["time_s"][1:])),
            found["largest_angle_error_rad"],
            found["mean_angle_error_rad"],
        ]
        for rule, found in network.items()
    ]
    return write_table(folder / "network", columns, rows)


def _tracks(folder: Path, cases: Cases) -> str:
    columns = {
        "case": "d",
        "solver": "",
        "cost": ".6f",
        "feasible": "",
        "energy [J]": ".2f",
        "ideal's energy [J]": ".2f",
        "gap [J]": ".2f",
        "ZMP margin [m]": ".4f",
        "largest error [rad]": ".4f",
        "K_p [N m/rad]": ".3f",
        "K_d [N m s/rad]": ".3f",
        "torso [rad]": ".4f",
    }

    def row(case: int, solver: str) -> list[Cell]:
        run, ideal = cases[case]["track"][solver], cases[case]["ideal"]["indexes"]["energy_J"]
        own = run["indexes"]
        energies: list[Cell] = [own["energy_J"], ideal, own["energy_J"] - ideal]
        judged: list[Cell] = [run["objective"], "yes" if run["feasible"] else "no"]
        return [case, solver, *judged, *energies, own["zmp_margin_min_m"], own["largest_error_rad"], *run["x"].values()]

    return write_table(
        folder / "tracks", columns, [row(case, solver) for case in cases for solver in cases[case]["track"]]
    )
