"""Claims of others about NAO's walk, each held against what is found here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scipy.stats import fisher_exact

from compare.papers.nao.nao_claims import FAILS, HOLDS, SIGNIFICANT
from compare.papers.nao_walk.nao_walk_findings import KNEE, SAGITTAL, Findings, Point
from compare.papers.nao_walk.nao_walk_runs import KINDS, PAPER_HEAT, SHEET_HEAT
from compare.papers.nao_walk.nao_walk_sources import (
    ACTIVE_MIN,
    BATTERY_WH,
    DATA_SHEET,
    DEFAULT_SPEED,
    KNEES,
    LOW_POWER,
    SPEED_M_S,
    STRAIGHT,
    TORSO_M,
    Source,
)

PARTLY = "holds in part"


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """What a source says, and what is found here."""

    text: str
    source: Source
    evidence: str
    verdict: str


def claims(findings: Findings) -> list[Claim]:
    """All of them, in the order of the report."""
    return [
        _knees(findings),
        _straight(findings),
        _heat(findings),
        _efficient(findings),
        _robust(findings),
        _fast(findings),
        _speed(findings),
        _battery(findings),
    ]


def _knees(findings: Findings) -> Claim:
    places = [(where, heat) for heat in ("sheet", "paper") for where in ("model", "engine")]
    shares = {place: findings.share("own", *place) for place in places}
    most = {place: KINDS[findings.largest("own", *place)] for place in places}
    aside = {place: KINDS[findings.largest("own", *place, SAGITTAL)] for place in places}
    told = [
        f"with K of the {name} {shares['model', heat]:.0%} in the model and {shares['engine', heat]:.0%} in the engine, where "
        f"{most['engine', heat]} draws most, and of the joints that turn forward {aside['engine', heat]}"
        for heat, name in (("sheet", "data sheet"), ("paper", "paper"))
    ]
    optimum = [findings.share("optimum-sheet", where, "sheet") for where in ("model", "engine")]
    held = [most[place] == KINDS[KNEE] for place in places]
    partly = any(held) or any(kind == KINDS[KNEE] for kind in aside.values())
    return Claim(
        text="The torque on the knee makes the main contribution to the energy that a gait of NAO consumes "
        "(measured on the robot)",
        source=KNEES,
        evidence=f"share of the knees in the robot's own walk: {'; '.join(told)}. In the optimum at that speed, with K of the "
        f"data sheet, {optimum[0]:.0%} and {optimum[1]:.0%}",
        verdict=HOLDS if all(held) else PARTLY if partly else FAILS,
    )


def _straight(findings: Findings) -> Claim:
    heights = findings.torsos
    own = next(point for point in heights if point["torso_m"] == TORSO_M)
    told: list[str] = []
    tallest_best: list[bool] = []
    taller_better: list[bool] = []
    for heat, name in (("sheet", "data sheet"), ("paper", "paper")):
        key = f"{heat}_J_per_m"
        best = min(heights, key=lambda point: float(point[key]))
        tallest_best.append(best is heights[-1])
        taller_better.append(best["torso_m"] > TORSO_M)
        told.append(
            f"with K of the {name} least energy at {1000 * best['torso_m']:.0f} mm, {100 * (best[key] / own[key] - 1):+z.1f} %, "
            f"at {1000 * heights[-1]['torso_m']:.0f} mm {100 * (heights[-1][key] / own[key] - 1):+z.1f} %"
        )
    optimum = findings.straighter["sheet"]["free"]
    gain = 100.0 * (1.0 - optimum["power_W"] / SPEED_M_S / own["sheet_J_per_m"])
    return Claim(
        text="A gait that bends the knees least is the most efficient one, better than the maker's",
        source=STRAIGHT,
        evidence=f"the robot's own walk with its torso higher than the documented {1000 * TORSO_M:.0f} mm, up to "
        f"{1000 * heights[-1]['torso_m']:.0f} mm, where legs still reach (knees bent by {heights[-1]['knee_deg']:.0f} instead of "
        f"{own['knee_deg']:.0f} degrees): {'; '.join(told)}. The optimum with K of the data sheet has "
        f"{optimum['knee_deg']:.0f} degrees and needs {gain:.0f} % less than that walk",
        verdict=HOLDS if all(tallest_best) else PARTLY if any(taller_better) else FAILS,
    )


def _heat(findings: Findings) -> Claim:
    heats = list(findings.straighter)
    free = {heat: findings.straighter[heat]["free"] for heat in heats}
    first, sheet = free[heats[0]], free["sheet"]
    rise = 1000.0 * (sheet["hip_m"] - first["hip_m"])
    bounded = {heat: findings.straighter[heat]["paper"] for heat in (heats[0], "sheet")}
    angles = ", ".join(f"{free[heat]['knee_deg']:.1f}" for heat in heats[:-1])
    return Claim(
        text="Torque is what costs: a larger heat constant turns the optimum towards straighter knees",
        source=STRAIGHT,
        evidence=f"mean angle of the knees in the optimum at {SPEED_M_S:g} m/s, legs free to stretch, for K = "
        f"{', '.join(heats[:-1])} W/(Nm)^2: {angles} degrees; K of the data sheet: {sheet['knee_deg']:.1f} degrees, the hip "
        f"{rise:+z.1f} mm against K = {heats[0]}. Within the paper's bound on the hip: {bounded[heats[0]]['knee_deg']:.1f} and "
        f"{bounded['sheet']['knee_deg']:.1f} degrees",
        verdict=f"holds by {first['knee_deg'] - sheet['knee_deg']:.1f} degrees"
        if sheet["knee_deg"] < first["knee_deg"]
        else FAILS,
    )


def _efficient(findings: Findings) -> Claim:
    plain, fed = ([point["sheet_J_per_m"] for point in findings.servos[name]] for name in ("none", "torque"))
    gain, share = _best(findings, plain)
    others, _ = _best(findings, fed)
    return Claim(
        text="Limiting each motor's power makes the walk more efficient",
        source=LOW_POWER,
        evidence=f"{_listed(findings, plain)} on position servos without feed-forward; with torques fed forward "
        f"{_listed(findings, fed)}. The best softer servos change it by {-100 * gain:+z.1f} % (stiffness "
        f"{share:g}) and {-100 * others:+z.1f} %",
        verdict=f"holds by {100 * gain:.1f} %" if gain > 0.0 else FAILS,
    )


def _robust(findings: Findings) -> Claim:
    plain, fed = ([point["falls"] for point in findings.servos[name]] for name in ("none", "torque"))
    of = findings.servos["none"][0]["disturbances"]
    fewest = min(plain[1:])
    chance = fisher_exact([[fewest, of - fewest], [plain[0], of - plain[0]]], alternative="less").pvalue
    told = f"{fewest} falls instead of {plain[0]}"
    verdict = (
        f"holds: {told}" if chance < SIGNIFICANT else f"not shown: {told} may be chance (Fisher: p = {chance:.2g})"
    )
    return Claim(
        text="Limiting each motor's power makes the walk more robust",
        source=LOW_POWER,
        evidence=f"falls in {of} disturbed walks, at stiffness {_shares(findings)}: {', '.join(map(str, plain))} without "
        f"feed-forward, {', '.join(map(str, fed))} with it",
        verdict=verdict if fewest < plain[0] else FAILS,
    )


def _fast(findings: Findings) -> Claim:
    plain, fed = ([100.0 * point["fastest_m_s"] for point in findings.servos[name]] for name in ("none", "torque"))
    faster = max(plain[1:]) > plain[0]
    return Claim(
        text="Limiting each motor's power makes the walk faster",
        source=LOW_POWER,
        evidence=f"fastest walk that stays up, by longer steps, at stiffness {_shares(findings)}: "
        f"{', '.join(f'{speed:.1f}' for speed in plain)} cm/s without feed-forward, "
        f"{', '.join(f'{speed:.1f}' for speed in fed)} cm/s with it",
        verdict=f"holds by {100 * (max(plain[1:]) / plain[0] - 1):.0f} %" if faster else FAILS,
    )


def _speed(findings: Findings) -> Claim:
    found: list[float] = []
    told: list[str] = []
    for heat in (PAPER_HEAT, SHEET_HEAT):
        least, here = findings.cheapest(heat), findings.at_default(heat)
        above = 100.0 * (here["cost_of_transport"] / least["cost_of_transport"] - 1.0)
        edge = ", the fastest computed" if least is findings.curve(heat)[-1] else ""
        told.append(
            f"with {heat} {here['cost_of_transport']:.3f} there against {least['cost_of_transport']:.3f} at "
            f"{100 * least['speed_m_s']:.1f} cm/s{edge}"
        )
        found.append(above)
    return Claim(
        text=f"The default walking speed is {100 * SPEED_M_S:.2f} cm/s",
        source=DEFAULT_SPEED,
        evidence=f"least cost of transport of optimal gaits: {'; '.join(told)}",
        verdict=f"dearer than the cheapest speed by {found[0]:.1f} % (K of the paper) and {found[1]:.1f} % (data sheet)",
    )


def _battery(findings: Findings) -> Claim:
    drained = 60.0 * BATTERY_WH / ACTIVE_MIN
    ours = {
        name: _power(findings.joints[name], findings.engine_J_per_m(name, "sheet")) for name in ("own-plain", "own")
    }
    told = " and ".join("a fall" if power is None else f"{power:.1f} W" for power in ours.values())
    share = max((power for power in ours.values() if power is not None), default=0.0) / drained
    return Claim(
        text=f"In active use the battery of {BATTERY_WH:g} Wh lasts {ACTIVE_MIN:.0f} min: {drained:.1f} W",
        source=DATA_SHEET,
        evidence=f"the motors of the robot's own walk draw, with K of the data sheet, {told} in the engine (without and with "
        "feed-forward); computer, boards, friction and gears are not modelled",
        verdict=f"no contradiction: at most {share:.0%} of it" if 0.0 < share < 1.0 else FAILS,
    )


def _power(walk: Point, energy_J_per_m: float | None) -> float | None:
    return None if energy_J_per_m is None else energy_J_per_m * walk["walked_m"] / walk["duration_s"]


def _best(findings: Findings, energies: Sequence[float | None]) -> tuple[float, float]:
    """Largest saving against full stiffness, and the stiffness; a walk that falls saves nothing."""
    full = energies[0]
    found = [
        (1.0 - energy / full, share)
        for share, energy in zip(findings.stiffnesses[1:], energies[1:], strict=True)
        if energy is not None and full is not None
    ]
    return max(found, default=(0.0, findings.stiffnesses[0]))


def _listed(findings: Findings, energies: Sequence[float | None]) -> str:
    told = ("falls" if energy is None else f"{energy:.1f}" for energy in energies)
    return f"{', '.join(told)} J/m at stiffness {_shares(findings)}"


def _shares(findings: Findings) -> str:
    return ", ".join(f"{share:g}" for share in findings.stiffnesses)
