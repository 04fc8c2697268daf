"""Claims of others about NAO's walk, each checked against our numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from scipy.stats import fisher_exact

from compare.papers.nao_walk.nao_walk_findings import KNEE, SAGITTAL, NaoWalkFindings
from compare.papers.nao_walk.nao_walk_runs import KINDS, SPECS
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
)
from compare.papers.reproduction import SIGNIFICANT, Claim, Verdict, check_claim

HEATS = {"sheet": "data sheet", "paper": "paper"}


def check_claims(findings: NaoWalkFindings) -> list[Claim]:
    """Return all claims, in the order of the report."""
    return [
        _check_knees(findings),
        _check_straight(findings),
        _check_heat(findings),
        _check_efficient(findings),
        _check_robust(findings),
        _check_fast(findings),
        _check_speed(findings),
        _check_battery(findings),
    ]


def _judge(holds: Iterable[bool], in_part: Iterable[bool]) -> Verdict:
    if all(holds):
        return Verdict.HOLDS
    return Verdict.HOLDS_IN_PART if any(in_part) else Verdict.FAILS


def _check_knees(findings: NaoWalkFindings) -> Claim:
    places = [(where, heat) for heat in HEATS for where in ("model", "engine")]
    shares = {place: findings.share("own", *place) for place in places}
    most = {place: findings.largest("own", *place) for place in places}
    forward = {place: findings.largest("own", *place, SAGITTAL) for place in places}
    found = [
        f"with K of the {name} {shares['model', heat]:.0%} in the model and {shares['engine', heat]:.0%} in the engine, where "
        f"{KINDS[most['engine', heat]]} draws most, and of the joints that turn forward {KINDS[forward['engine', heat]]}"
        for heat, name in HEATS.items()
    ]
    optimum = [findings.share("optimum-sheet", where, "sheet") for where in ("model", "engine")]
    return Claim(
        where=str(KNEES),
        text="The torque on the knee makes the main contribution to the energy that a gait of NAO consumes (measured on the "
        "robot)",
        found=f"share of the knees in the robot's own walk: {'; '.join(found)}. In the optimum at that speed, with K of the "
        f"data sheet, {optimum[0]:.0%} and {optimum[1]:.0%}",
        verdict=_judge(
            [kind == KNEE for kind in most.values()], [kind == KNEE for kind in (*most.values(), *forward.values())]
        ),
    )


def _check_straight(findings: NaoWalkFindings) -> Claim:
    heights = findings.torsos
    own, tallest = next(point for point in heights if point["torso_m"] == TORSO_M), heights[-1]
    best = {heat: min(heights, key=lambda point: float(point[f"{heat}_J_per_m"])) for heat in HEATS}
    found = []
    for heat, name in HEATS.items():
        at_best, at_tallest = (
            100 * (point[f"{heat}_J_per_m"] / own[f"{heat}_J_per_m"] - 1) for point in (best[heat], tallest)
        )
        found.append(
            f"with K of the {name} least energy at {1000 * best[heat]['torso_m']:.0f} mm, {at_best:+z.1f} %, "
            f"at {1000 * tallest['torso_m']:.0f} mm {at_tallest:+z.1f} %"
        )
    optimum = findings.straighter["sheet"]["free"]
    gain = 100.0 * (1.0 - optimum["power_W"] / SPEED_M_S / own["sheet_J_per_m"])
    return Claim(
        where=str(STRAIGHT),
        text="A gait that bends the knees least is the most efficient one, better than the maker's",
        found=f"the robot's own walk with its torso higher than the documented {1000 * TORSO_M:.0f} mm, up to "
        f"{1000 * tallest['torso_m']:.0f} mm, where legs still reach (knees bent by {tallest['knee_deg']:.0f} instead of "
        f"{own['knee_deg']:.0f} degrees): {'; '.join(found)}. The optimum with K of the data sheet has "
        f"{optimum['knee_deg']:.0f} degrees and needs {gain:.0f} % less than that walk",
        verdict=_judge(
            [point is tallest for point in best.values()], [point["torso_m"] > TORSO_M for point in best.values()]
        ),
    )


def _check_heat(findings: NaoWalkFindings) -> Claim:
    *heats, _ = findings.straighter
    least = heats[0]
    free, bounded = ({heat: at[bound] for heat, at in findings.straighter.items()} for bound in ("free", "paper"))
    rise = 1000.0 * (free["sheet"]["hip_m"] - free[least]["hip_m"])
    angles = ", ".join(f"{free[heat]['knee_deg']:.1f}" for heat in heats)
    straighter = free[least]["knee_deg"] - free["sheet"]["knee_deg"]
    return check_claim(
        straighter > 0,
        where=str(STRAIGHT),
        text="Torque is what costs: a larger heat constant turns the optimum towards straighter knees",
        found=f"mean angle of the knees in the optimum at {SPEED_M_S:g} m/s, legs free to stretch, for K = "
        f"{', '.join(heats)} W/(Nm)^2: {angles} degrees; "
        f"K of the data sheet: {free['sheet']['knee_deg']:.1f} degrees, the hip {rise:+z.1f} mm against K = {least}. "
        f"Within the paper's bound on the hip: {bounded[least]['knee_deg']:.1f} and "
        f"{bounded['sheet']['knee_deg']:.1f} degrees",
        detail=f"by {straighter:.1f} degrees",
    )


def _check_efficient(findings: NaoWalkFindings) -> Claim:
    plain, fed = ([point["sheet_J_per_m"] for point in findings.drives[name]] for name in ("none", "torque"))
    gain, share = _find_saving(findings, plain)
    others, _ = _find_saving(findings, fed)
    return check_claim(
        gain > 0.0,
        where=str(LOW_POWER),
        text="Limiting each motor's power makes the walk more efficient",
        found=f"{_list_energies(findings, plain)} on position drives without feed-forward; with torques fed forward "
        f"{_list_energies(findings, fed)}. The best softer drives change it by {-100 * gain:+z.1f} % (stiffness "
        f"{share:g}) and {-100 * others:+z.1f} %",
        detail=f"by {100 * gain:.1f} %",
    )


def _check_robust(findings: NaoWalkFindings) -> Claim:
    plain, fed = ([point["falls"] for point in findings.drives[name]] for name in ("none", "torque"))
    count = findings.drives["none"][0]["disturbances"]
    fewest = min(plain[1:])
    verdict, detail = Verdict.FAILS, ""
    if fewest < plain[0]:
        p = fisher_exact([[fewest, count - fewest], [plain[0], count - plain[0]]], alternative="less").pvalue
        verdict, detail = Verdict.HOLDS, f"({fewest} falls instead of {plain[0]})"
        if p >= SIGNIFICANT:
            detail = f"({fewest} falls instead of {plain[0]} may be chance, Fisher: p = {p:.2g})"
            verdict = Verdict.NOT_SHOWN
    return Claim(
        where=str(LOW_POWER),
        text="Limiting each motor's power makes the walk more robust",
        found=f"falls in {count} disturbed walks, at stiffness {_list_stiffnesses(findings)}: {', '.join(map(str, plain))} "
        f"without feed-forward, {', '.join(map(str, fed))} with it",
        verdict=verdict,
        detail=detail,
    )


def _check_fast(findings: NaoWalkFindings) -> Claim:
    plain, fed = ([100.0 * point["fastest_m_s"] for point in findings.drives[name]] for name in ("none", "torque"))
    full, best = plain[0], max(plain[1:])
    return check_claim(
        best > full,
        where=str(LOW_POWER),
        text="Limiting each motor's power makes the walk faster",
        found=f"fastest walk without a fall, by longer steps, at stiffness {_list_stiffnesses(findings)}: "
        f"{', '.join(f'{speed:.1f}' for speed in plain)} cm/s without feed-forward, "
        f"{', '.join(f'{speed:.1f}' for speed in fed)} cm/s with it",
        detail=f"by {100 * (best / full - 1):.0f} %" if full else "",
    )


def _check_speed(findings: NaoWalkFindings) -> Claim:
    above: list[float] = []
    found: list[str] = []
    for heat in SPECS:
        cheapest, default = findings.cheapest(heat), findings.at_default(heat)
        above.append(100.0 * (default["cost_of_transport"] / cheapest["cost_of_transport"] - 1.0))
        edge = ", the fastest computed" if cheapest is findings.curve(heat)[-1] else ""
        found.append(
            f"with K of the {HEATS[heat]} {default['cost_of_transport']:.3f} there against "
            f"{cheapest['cost_of_transport']:.3f} at {100 * cheapest['speed_m_s']:.1f} cm/s{edge}"
        )
    return Claim(
        where=str(DEFAULT_SPEED),
        text=f"The default walking speed is {100 * SPEED_M_S:.2f} cm/s",
        found=f"least cost of transport of optimal gaits: {'; '.join(found)}",
        verdict=Verdict.UNTESTABLE,
        detail=f"(dearer than the cheapest speed by {above[0]:.1f} % with K of the paper and {above[1]:.1f} % "
        "with that of the data sheet)",
    )


def _check_battery(findings: NaoWalkFindings) -> Claim:
    drained = 60.0 * BATTERY_WH / ACTIVE_MIN
    energies = {name: findings.engine_J_per_m(name, "sheet") for name in ("own-plain", "own")}
    powers = {
        name: None if energy is None else energy * walk["walked_m"] / walk["duration_s"]
        for name, energy in energies.items()
        for walk in [findings.joints[name]]
    }
    found = " and ".join("a fall" if power is None else f"{power:.1f} W" for power in powers.values())
    share = max((power for power in powers.values() if power is not None), default=0.0) / drained
    possible = 0.0 < share < 1.0
    return Claim(
        where=str(DATA_SHEET),
        text=f"In active use the battery of {BATTERY_WH:g} Wh lasts {ACTIVE_MIN:.0f} min: {drained:.1f} W",
        found=f"the motors of the robot's own walk draw, with K of the data sheet, {found} in the engine (without and with "
        "feed-forward); computer, boards, friction and gears are not modelled",
        verdict=Verdict.UNTESTABLE if possible else Verdict.FAILS,
        detail=f"(no contradiction: at most {share:.0%} of it)" if possible else "",
    )


def _find_saving(findings: NaoWalkFindings, energies: Sequence[float | None]) -> tuple[float, float]:
    """Largest saving against full stiffness, and the stiffness; a walk that falls saves nothing."""
    full, stiffnesses = energies[0], findings.effort.stiffnesses
    found = [
        (1.0 - energy / full, share)
        for share, energy in zip(stiffnesses[1:], energies[1:], strict=True)
        if energy is not None and full is not None
    ]
    return max(found, default=(0.0, stiffnesses[0]))


def _list_energies(findings: NaoWalkFindings, energies: Sequence[float | None]) -> str:
    listed = ("falls" if energy is None else f"{energy:.1f}" for energy in energies)
    return f"{', '.join(listed)} J/m at stiffness {_list_stiffnesses(findings)}"


def _list_stiffnesses(findings: NaoWalkFindings) -> str:
    return ", ".join(f"{share:g}" for share in findings.effort.stiffnesses)
