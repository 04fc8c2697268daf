"""Print what the optimum and the paper's gaits survive in open loop, side by side.

    python benchmarks/robustness.py

A quarter of an hour or more; needs the extra ``sim``. The paper's gaits: Gupta, Pratihar, Deb (2023), Tables 6 and 8.
"""

import nlp_gait
from nlp_gait.problem import Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import measure
from nlp_gait.simulation.plan import plan_of
from nlp_gait.simulation.playback import play
from nlp_gait.simulation.robustness import DIRECTIONS, robustness

PAPER = {
    "nao-ssp": {
        "paper's PSO": (0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.015, 4),
        "paper's GA": (0.31, -0.005, 0, 0.0031, 0.0017, 0.0364, -0.0135, 0.015, 4),
    },
    "nao-dsp": {
        "paper's PSO": (0.31, -0.0008, -0.0055, 0.052, 0.001, -0.0367, -0.0424, 2),
        "paper's GA": (0.31, 0.0002, -0.0052, 0.0582, 0.001, -0.0384, -0.0405, 2),
    },
}


def gaits() -> dict[str, Result]:
    """Optimum of each phase, in double support also with the lever rule, and the paper's gaits."""
    found = {}
    for name, published in PAPER.items():
        problem = nlp_gait.load(name)
        solved = {f"{name}, optimum": problem}
        if name == "nao-dsp":
            solved[f"{name}, optimum, lever rule"] = nlp_gait.load(name, torso_share="lever")
        for label, variant in solved.items():
            optimum = nlp_gait.solve(variant, starts=5, seed=0)
            found[label] = Result(problem=variant, x=variant.check_x(list(optimum.x.values())))
        for label, x in published.items():
            found[f"{name}, {label}"] = Result(problem=problem, x=problem.check_x(x))
    return found


def main() -> None:
    """Two Markdown tables: undisturbed, and what is survived."""
    plans = {label: plan_of(result) for label, result in gaits().items()}
    print(
        "| gait | model W (mechanical) | engine W (mechanical) | tilt deg | slip mm | landing mm | pressure RMS, middle, raw mm |"
    )
    print("|---|---|---|---|---|---|---|")
    for label, plan in plans.items():
        m = measure(plan, play(plan), Drive())
        powers = " | ".join(f"{p.total_W:.3f} ({p.mechanical_W:.3f})" for p in (m.predicted, m.measured))
        landing = ", ".join(f"{1e3 * at.error_m:.1f}" for at in m.landings.values()) or "-"
        pressure = [m.pressure_rms_m, m.pressure_middle_rms_m, m.pressure_raw_rms_m]
        shown = ", ".join("-" if value is None else f"{1e3 * value:.1f}" for value in pressure)
        state = " **falls**" if m.fallen else ""
        print(f"| {label}{state} | {powers} | {m.largest_tilt_deg:.2f} | {1e3 * m.slip_m:.1f} | {landing} | {shown} |")
    ways = " / ".join(DIRECTIONS)
    print(f"\n| gait | push N s {ways} | slope deg, rising {ways} | friction 0.3 to 1.0 | mass -10 % / +10 % |")
    print("|---|---|---|---|---|")
    for label, plan in plans.items():
        r = robustness(plan)
        pushes, slopes = (" / ".join(f"{v:g}" for v in values.values()) for values in (r.push_Ns, r.slope_deg))
        falls = [f"{value:g}" for value, survived in r.friction.items() if not survived]
        masses = " / ".join("stays up" if survived else "falls" for survived in r.mass_factor.values())
        frictions = f"falls at {', '.join(falls)}" if falls else "stays up"
        print(f"| {label} | {pushes} | {slopes} | {frictions} | {masses} |", flush=True)


if __name__ == "__main__":
    main()
