"""Print the calibration tables: error of power and zero-moment point for random feasible gaits, slow to fast.

    python benchmarks/calibration.py

About a minute; needs the extra ``sim``.
"""

import nlp_gait
from nlp_gait.simulation.calibration import calibrate, shortest_true_s

SHORTEST_S = {"nao-ssp": 0.4, "nao-dsp": 0.28}  # double support: below 0.28 s hardly any random gait is feasible

TOLERANCE = 0.15  # of the total power


def main() -> None:
    """One Markdown table a phase."""
    for name, shortest in SHORTEST_S.items():
        print(f"\n### {name}\n")
        print(
            "| time s | model W | engine W | error | CoP RMS mm | engine W, smooth set-points | error | CoP RMS mm | |"
        )
        print("|---|---|---|---|---|---|---|---|---|")
        cases = []
        for case in calibrate(nlp_gait.load(name), shortest):
            cases.append(case)
            cells = [f"{case.duration_s:.2f}", f"{case.measurements.predicted.total_W:.3f}"]
            for m in (case.measurements, case.smooth):
                pressure = "-" if m.pressure_rms_m is None else f"{1e3 * m.pressure_rms_m:.1f}"
                cells += [f"{m.measured.total_W:.3f}", f"{m.power_error:+.0%}", pressure]
            fallen = [label for label, m in (("40 ms", case.measurements), ("smooth", case.smooth)) if m.fallen]
            cells.append(f"falls ({', '.join(fallen)})" if fallen else "stays up")
            print(f"| {' | '.join(cells)} |", flush=True)
        for label, attribute in (("40 ms", "measurements"), ("smooth", "smooth")):
            held = shortest_true_s([(case.duration_s, getattr(case, attribute)) for case in cases], TOLERANCE)
            found = "not even for the slowest gait" if held is None else f"down to {held:.2f} s"
            print(f"\nSet-points {label}: power within {TOLERANCE:.0%} {found}.")


if __name__ == "__main__":
    main()
