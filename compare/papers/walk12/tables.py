"""Findings of the reproduced 12-joint walk, and its tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from compare.papers.tables import Cell, write_table
from compare.papers.walk12.paper import F1MAX, F2MAX, TABLE_3, TABLE_4
from compare.papers.walk12.runs import Run

PAPER, MODEL = "paper", "model"  # whose f1max


@dataclass(frozen=True, kw_only=True)
class Findings:
    """All results, as kept in the steps.

    Attributes:
        own_f1max: the model's largest f1 [1/(m^2 s)].
        table_3: by normalisation, one entry for each row of Table III: runs by solver.
        table_4: one entry for each row of Table IV and horizon.
        weighted: optima of the weighted sum over lambda.
        front: largest f1 for each step length.
        errata: see ``walk12_errata``.
    """

    own_f1max: float
    table_3: Mapping[str, Sequence[Mapping[str, Run]]]
    table_4: Sequence[Run]
    weighted: Sequence[Run]
    front: Sequence[Run]
    errata: Run

    def runs(self, label: str, weight: float) -> Mapping[str, Run]:
        """Runs by solver at a lambda under a normalisation."""
        return self.table_3[label][[row.weight for row in TABLE_3].index(weight)]

    def f1max(self, label: str) -> float:
        """f1 that counts as 1 under a normalisation."""
        return F1MAX if label == PAPER else self.own_f1max


def f_of_papers_gaits(findings: Findings, label: str) -> list[float]:
    """f of the paper's gaits in the model under a normalisation, on the dense grid."""
    f1max = findings.f1max(label)
    known = zip(TABLE_3, findings.errata["f1"]["exact"], strict=True)
    return [row.weight * f1 / f1max + (1 - row.weight) * row.x[0] / F2MAX for row, f1 in known]


def table_3(folder: Path, findings: Findings, label: str) -> str:
    """f of the paper's gait and of every solver under one normalisation."""
    spread = [(solver, which) for solver in ("ga", "pso") for which in ("best", "median", "worst")]
    columns = {"lambda": ".2f", "paper: f as printed": ".3f", "model: f of the paper's gait": ".4f"}
    columns |= {f"{solver.upper()} {which}": ".4f" for solver, which in spread}
    columns |= {"IPOPT": ".4f", "IPOPT, dense grid": ".4f", "starts that agree": "d", "time of a start [s]": ".3f"}
    rows: list[list[Cell]] = []
    for row, model, runs in zip(TABLE_3, f_of_papers_gaits(findings, label), findings.table_3[label], strict=True):
        ipopt = runs["ipopt"]
        searches = [runs[solver][which] for solver, which in spread]
        end = [ipopt["f"], ipopt["dense"]["f"], ipopt["agreeing"], ipopt["time_s"]]
        rows.append([row.weight, row.f, model, *searches, *end])
    return write_table(folder / f"table3-{label}", columns, rows)


def gaits(folder: Path, findings: Findings) -> str:
    """Gaits behind Table III under the paper's normalisation, and how long each is statically stable."""
    columns = {"lambda": ".2f", "by": ""} | {f"{name} [m]": ".4f" for name in "snHh"}
    columns |= {"f1 [1/(m^2 s)]": ".1f", "share of the step with (8)": ".3f"}
    rows: list[list[Cell]] = []
    known = zip(
        TABLE_3, findings.errata["f1"]["exact"], findings.errata["stable"], findings.table_3[PAPER], strict=True
    )
    for row, f1, stable, runs in known:
        rows.append([row.weight, "paper", *row.x, f1, stable["share"]])
        for solver in ("ga", "pso", "ipopt"):
            dense = runs[solver]["dense"]
            rows.append([row.weight, solver.upper(), *runs[solver]["x"], dense["f1_per_m2s"], dense["stable_share"]])
    return write_table(folder / "gaits", columns, rows)


def table_4(folder: Path, findings: Findings) -> str:
    """The paper's step times under both horizons of Q."""
    columns = {"T [s]": ".1f", "horizon of Q": "", "paper: f1max": ".1f", "paper: f": ".4f"}
    columns |= {"paper: f1 implied": ".0f", "model: f1 of the paper's gait": ".0f"}
    columns |= {"model: f1max": ".1f", "IPOPT: f": ".4f"} | {f"{name} [m]": ".4f" for name in "snHh"}
    rows: list[list[Cell]] = []
    for run in findings.table_4:
        row = next(row for row in TABLE_4 if row.step_time_s == run["step_time_s"])
        horizon = {"step": "0 to T", "1s": "1 s"}[run["horizon"]]
        ours = [run["paper_f1"], run["f1max"], run["optimum"]["f"], *run["optimum"]["x"]]
        rows.append([row.step_time_s, horizon, row.f1max, row.f, run["implied_f1"], *ours])
    return write_table(folder / "table4", columns, rows)
