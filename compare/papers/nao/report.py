"""Report of the reproduced NAO paper."""

from __future__ import annotations

from pathlib import Path

from compare.papers.nao.claims import claims
from compare.papers.nao.findings import ALGORITHMS, NAMES, Findings, PhaseFindings
from compare.papers.nao.tables import (
    durations_table,
    gap_table,
    indexes_table,
    runs_table,
    swing_table,
    tests_table,
    variables_table,
)
from compare.papers.tables import write_csv
from nlp_gait.files import write_text


def write_report(folder: Path, findings: Findings) -> None:
    """Write all tables and ``report.md``."""
    ssp, dsp = findings.phases
    parts = [
        _introduction(findings),
        "## The paper's claims",
        _claims(folder, findings),
        "## Single support",
        *_phase(folder, ssp),
        "### Table 7, rows 6 to 11: swing heights",
        swing_table(folder, findings),
        _swing_remark(),
        "### Durations",
        durations_table(folder, findings),
        "## Double support",
        *_phase(folder, dsp),
        _double_support_remark(findings),
        "## Section 5.3: PSO against GA",
        tests_table(folder, findings),
        _tests_remark(),
        "## Where the paper's power does not reproduce",
        gap_table(folder, findings),
        _gap_remark(findings),
        "## Figures",
        *(_figures(phase, letter) for phase, letter in zip(findings.phases, "ab", strict=True)),
    ]
    write_text(folder / "report.md", "\n\n".join(part.strip() for part in parts) + "\n")


def _introduction(findings: Findings) -> str:
    ssp = findings.ssp
    runs = ssp.searches["pso"]
    return f"""
# The gait cycle of NAO: Gupta, Pratihar, Deb (2023), reproduced

*Analysis and optimization of gait cycle of 25-DOF NAO robot using particle swarm optimization and genetic algorithms.* Every
number is computed by this program from the paper's equations, except those under "paper". Both support phases minimise mean
electrical power within the limits of section 4.

- **PSO, GA**: {len(runs)} paired runs each with the paper's settings, {len(runs[0]["history_W"])} generations of 50 evaluations;
  equal runs start from the same population. "Our PSO" and "our GA" in the tables are the runs of median power, as in the paper.
- **IPOPT**: best of {len(ssp.starts)} random starts on the lifted problem.
- All values are the judge's: the exact functions on the paper's 11 samples. Robot: {ssp.problem.options["robot"]}."""


def _claims(folder: Path, findings: Findings) -> str:
    found = claims(findings)
    rows = [[claim.section, claim.text, claim.verdict, claim.evidence] for claim in found]
    write_csv(folder / "claims.csv", ["section", "claim", "verdict", "evidence"], rows)
    return "\n".join(f"- *{c.text}* ({c.section}): **{c.verdict}**. Found here: {c.evidence}." for c in found)


def _phase(folder: Path, phase: PhaseFindings) -> list[str]:
    variables, indexes = phase.paper.tables
    runs = ", ".join(f"{phase.median_run(name)} of {NAMES[name]}" for name in ALGORITHMS)
    return [
        f"### All runs of {phase.problem.name}",
        runs_table(folder, phase),
        f"{phase.converged} of {len(phase.starts)} starts of IPOPT end within 1e-5 of the best. Runs of median power: {runs}.",
        _between_samples(phase),
        f"### Table {variables}: variables",
        variables_table(folder, phase),
        f"### Table {indexes}: performance figures",
        indexes_table(folder, phase),
    ]


def _between_samples(phase: PhaseFindings) -> str:
    """How many final solutions break a limit between the samples on which the paper states it."""
    ends = [run for runs in phase.searches.values() for run in runs if run["feasible"]]
    broken = [run for run in ends if run["dense_violated"]]
    optimum = phase.optimum["dense_violated"]
    at_optimum = f"IPOPT's optimum breaks {optimum[0]}" if optimum else "IPOPT's optimum does not"
    return f"Between the samples, on 1000 intervals, {len(broken)} of {len(ends)} runs of PSO and GA break a limit; {at_optimum}."


def _swing_remark() -> str:
    return """
The column of IPOPT holds the swing height and optimises all else: that is the price of a higher step. The columns of histories do
what the paper did: of the feasible solutions that a search happened to evaluate, they give the cheapest within 0.5 mm of the
height. A search has no reason to look at high steps once it knows better, so what it holds there are early, poor solutions, and
the price that they show depends on the algorithm and on the run."""


def _double_support_remark(findings: Findings) -> str:
    dsp = findings.dsp
    costs = [100 * (here["power_W"] / dsp.best - 1) for here in dsp.printed_here.values()]
    solved = [start["power_W"] for start in findings.lever if start["success"]]
    lever = f"{min(solved):.5f} W instead of {dsp.best:.5f} W" if solved else "no optimum"
    return f"""
In our model the paper's solutions cost {min(costs):.1f} to {max(costs):.1f} % more than IPOPT's: they begin fast and end
slowly in the walking direction (x4, x5), the optimum here begins slowly and ends fast. Equations (28) and (29) give the leg
*farther* from the hip the greater share of the torso's mass; with the lever rule, which the text describes, IPOPT finds {lever}
({len(solved)} of {len(findings.lever)} starts converged), and its velocities differ from the paper's in the same way."""


def _tests_remark() -> str:
    return """
z carries a continuity correction of one half; p-values are those of the normal approximation, as in the paper. A12 is the share
of all pairs of a PSO run and a GA run in which PSO's power is lower; in the paper's rows it follows from the printed rank sum.
The paper's "reject the null hypothesis that PSO is better" is a slip: the null hypothesis of the test is equality."""


def _gap_remark(findings: Findings) -> str:
    gaps, misses = [], []
    for phase in findings.phases:
        for name, printed in phase.paper.optima.items():
            gaps.append(printed.power_W - phase.printed_here[name]["power_W"])
            misses.append(100 * (phase.printed_with_legs_twice[name] / printed.power_W - 1))
    return f"""
The printed power of each printed solution is {min(gaps):.2f} to {max(gaps):.2f} W above what the printed equations give for it
here. As a remark only: counting the mechanical term |tau qd| of the leg joints twice would give the last column,
{min(misses):+.1f} to {max(misses):+.1f} % from the print. Nothing in the model is changed on that account."""


def _figures(phase: PhaseFindings, letter: str) -> str:
    paper = phase.paper
    number = paper.convergence_figure
    lines = [
        f"![Fig. {number}](fig{number:02d}.png)",
        f"Fig. {number}: least, mean and greatest of the runs' best power in each generation, {paper.title}; a line begins where "
        "all runs have found a feasible solution.",
    ]
    for figure, positions in paper.scatter_figures.items():
        names = ", ".join(f"x{i + 1}" for i in positions)
        lines += [
            f"![Fig. {figure}](fig{figure}.png)",
            f"Fig. {figure}: power against {names} over all feasible solutions evaluated in all runs; the line is IPOPT's "
            "optimum with that variable held.",
        ]
    below = 100 * max(phase.share_below(i) for i in phase.sweeps)
    lines += [
        f"The lowest feasible solution of {paper.title} beneath a line of IPOPT, which is straight between its points, lies "
        f"{below:.2f} % below it.",
        f"![Fig. 20 {letter}](fig20{letter}.png)",
        f"Fig. 20 ({letter}): IPOPT's gait in {paper.title}. The paper shows PSO's in a simulator; this one is drawn from the "
        "joint angles.",
    ]
    if letter == "a":
        lines += ["![Swing heights](swing-height.png)", "Price of a higher swing foot relative to 0.015 m."]
    return "\n\n".join(lines)
