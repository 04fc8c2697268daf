"""Findings about NAO's walk, and checks of the claims of others against them: ``nao_walk_claims.toml`` names them."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.stats import fisher_exact

from compare.papers.claims import SIGNIFICANT, Check, ClaimVerdict, decide, require_change
from compare.papers.nao_walk import nao_walk_runs
from compare.papers.nao_walk.nao_walk_runs import KINDS, SPECS, SPEED_M_S, NaoWalkEffort, sum_energy

Point = Mapping[str, Any]
KNEE = "KneePitch"
SAGITTAL = (KNEE, "HipPitch", "AnklePitch")  # kinds of joints that turn in the plane of the walk
LEAST_SAVING = 0.01  # of energy, which counts
HEATS = {"sheet": "data sheet", "paper": "paper"}


@dataclass(frozen=True, kw_only=True, eq=False)
class NaoWalkFindings:
    """All results."""

    effort: NaoWalkEffort  # what was computed
    # Cheapest gaits in the order of their speeds, by source of the heat constant.
    speeds: Mapping[str, Sequence[Point]]
    torsos: Sequence[Point]  # the robot's own walk in the order of its heights
    straighter: Mapping[str, Point]  # by heat constant, cheapest gaits at the default speed
    joints: Mapping[str, Point]  # by gait, energy of its joints
    drives: Mapping[str, Sequence[Point]]  # by feed-forward, the robot's own walk from full stiffness downwards

    def curve(self, heat: str) -> list[Point]:
        """Return the feasible gaits over speed."""
        return [point for point in self.speeds[heat] if point["feasible"]]

    def share(self, gait: str, where: str, heat: str, kind: str = KNEE) -> float:
        """Return the share of a kind of joint in mechanical energy and heat; ``where`` is ``model`` or ``engine``."""
        kinds = self.joints[gait][where]
        return float((kinds[kind]["mechanical"] + kinds[kind][heat]) / sum_energy(kinds.values(), heat))

    def largest(self, gait: str, where: str, heat: str, kinds: Iterable[str] = KINDS) -> str:
        """Return the kind of joint that draws most."""
        return max(kinds, key=lambda kind: self.share(gait, where, heat, kind))

    def engine_W(self, gait: str, heat: str) -> float | None:
        """Return the mean power in the engine [W]; None after a fall."""
        found = self.joints[gait]
        energy_J = sum_energy(found["engine"].values(), heat) * found["walked_m"]
        return None if found["fell_at_s"] is not None else energy_J / found["duration_s"]

    def over_stiffness(self, key: str) -> list[list[Any]]:
        """Return a result of the robot's own walk from full stiffness downwards, without and with torques fed forward."""
        return [[point[key] for point in self.drives[name]] for name in nao_walk_runs.FEED_FORWARD]


def _check_knees(findings: NaoWalkFindings) -> Check:
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
    return decide(all(kind == KNEE for kind in most.values()), found="; ".join(found), optimum=optimum)


def _check_straight(findings: NaoWalkFindings) -> Check:
    heights = findings.torsos
    own, tallest = next(point for point in heights if point["torso_m"] == nao_walk_runs.TORSO_M), heights[-1]
    best = {heat: min(heights, key=lambda point: float(point[f"{heat}_J_per_m"])) for heat in HEATS}
    torso_mm = 1000 * nao_walk_runs.TORSO_M
    tallest_mm = 1000 * tallest["torso_m"]
    found = []
    for heat, name in HEATS.items():
        key = f"{heat}_J_per_m"
        at_best, at_tallest = (100 * (point[key] / own[key] - 1) for point in (best[heat], tallest))
        found.append(
            f"with K of the {name} least energy at {1000 * best[heat]['torso_m']:.0f} mm, {at_best:+z.1f} %, "
            f"at {tallest_mm:.0f} mm {at_tallest:+z.1f} %"
        )
    optimum = findings.straighter["sheet"]["free"]
    verdict = ClaimVerdict.HOLDS if all(point is tallest for point in best.values()) else ClaimVerdict.SIZE_DIFFERS
    if not all(best[heat][f"{heat}_J_per_m"] <= (1 - LEAST_SAVING) * own[f"{heat}_J_per_m"] for heat in HEATS):
        verdict = ClaimVerdict.FAILS
    gain = 100.0 * (1.0 - optimum["power_W"] / SPEED_M_S / own["sheet_J_per_m"])
    values = {"tallest": tallest, "own": own, "found": "; ".join(found), "optimum": optimum, "gain": gain}
    return decide(verdict, torso_mm=torso_mm, tallest_mm=tallest_mm, **values)


def _check_heat(findings: NaoWalkFindings) -> Check:
    *heats, _ = findings.straighter
    free, bounded = ({heat: at[bound] for heat, at in findings.straighter.items()} for bound in ("free", "paper"))
    least, sheet = free[heats[0]], free["sheet"]
    straighter = least["knee_deg"] - sheet["knee_deg"]
    rise = 1000.0 * (sheet["hip_m"] - least["hip_m"])
    values = {"speed": SPEED_M_S, "free": sheet, "rise": rise, "least": heats[0], "straighter": straighter}
    values |= {"heats": ", ".join(heats), "angles": ", ".join(f"{free[heat]['knee_deg']:.1f}" for heat in heats)}
    values["bounded"] = [bounded[heat]["knee_deg"] for heat in (heats[0], "sheet")]
    return require_change(straighter, **values)


def _check_efficient(findings: NaoWalkFindings) -> Check:
    plain, fed = findings.over_stiffness("sheet_J_per_m")
    gain, stiffness = _find_saving(findings, plain)
    others, _ = _find_saving(findings, fed)
    changes = {"gain": 100 * gain, "change": -100 * gain, "change_fed": -100 * others, "stiffness": stiffness}
    texts = {name: _list_energies(findings, energies) for name, energies in (("plain", plain), ("fed", fed))}
    return require_change(100 * gain, **changes, **texts)


def _check_robust(findings: NaoWalkFindings) -> Check:
    plain, fed = findings.over_stiffness("falls")
    count, full, fewest = findings.drives["none"][0]["disturbances"], plain[0], min(plain[1:])
    verdict, chance = ClaimVerdict.FAILS, ""
    if fewest < full:
        p = fisher_exact([[fewest, count - fewest], [full, count - full]], alternative="less").pvalue
        verdict = ClaimVerdict.HOLDS
        if p >= SIGNIFICANT:
            verdict, chance = ClaimVerdict.NOT_SHOWN, f" may be chance, Fisher: p = {p:.2g}"
    texts = {"stiffnesses": _list_stiffnesses(findings), "chance": chance}
    texts |= {"plain": ", ".join(map(str, plain)), "fed": ", ".join(map(str, fed))}
    return decide(verdict, count=count, fewest=fewest, full=full, **texts)


def _check_fast(findings: NaoWalkFindings) -> Check:
    plain, fed = ([100.0 * speed for speed in speeds] for speeds in findings.over_stiffness("fastest_m_s"))
    gain = 100 * (max(plain[1:]) / plain[0] - 1) if plain[0] else math.inf
    texts = [", ".join(f"{speed:.1f}" for speed in speeds) for speeds in (plain, fed)]
    return require_change(gain, stiffnesses=_list_stiffnesses(findings), plain=texts[0], fed=texts[1], gain=gain)


def _check_speed(findings: NaoWalkFindings) -> Check:
    above, found = [], []
    for heat in SPECS:
        curve = findings.curve(heat)
        cheapest = min(curve, key=lambda point: float(point["cost_of_transport"]))
        default = next(point for point in curve if point["speed_m_s"] == SPEED_M_S)
        above.append(100.0 * (default["cost_of_transport"] / cheapest["cost_of_transport"] - 1.0))
        edge = ", the fastest computed" if cheapest is curve[-1] else ""
        found.append(
            f"with K of the {HEATS[heat]} {default['cost_of_transport']:.3f} there against "
            f"{cheapest['cost_of_transport']:.3f} at {100 * cheapest['speed_m_s']:.1f} cm/s{edge}"
        )
    return decide(ClaimVerdict.UNTESTABLE, speed=100 * SPEED_M_S, found="; ".join(found), above=above)


def _check_battery(findings: NaoWalkFindings) -> Check:
    battery_Wh, active_min = nao_walk_runs.BATTERY_WH, nao_walk_runs.ACTIVE_MIN
    drained = 60.0 * battery_Wh / active_min
    powers = [findings.engine_W(name, "sheet") for name in ("own-plain", "own")]
    share = max((power for power in powers if power is not None), default=0.0) / drained
    found = " and ".join("a fall" if power is None else f"{power:.1f} W" for power in powers)
    values = {"battery_Wh": battery_Wh, "active_min": active_min, "drained": drained, "share": share, "found": found}
    return decide(ClaimVerdict.UNTESTABLE if 0.0 < share < 1.0 else ClaimVerdict.FAILS, **values)


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
