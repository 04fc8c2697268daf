"""Print the calibration tables: error of power and zero-moment point for random feasible gaits, slow to fast.

    python benchmarks/calibration.py

About a minute; needs the extra ``sim``.
"""

import nlp_gait
from nlp_gait.simulation.calibration import calibrate

SHORTEST_S = {"nao-ssp": 0.4, "nao-dsp": 0.28}  # double support: below 0.28 s hardly any random gait is feasible


def main() -> None:
    """One Markdown table a phase."""
    for name, shortest in SHORTEST_S.items():
        print(f"\n### {name}\n")
        print("| time s | model W | mechanical, heat W | engine W | mechanical, heat W | error of power | pressure RMS mm | tilt deg | |")
        print("|---|---|---|---|---|---|---|---|---|")
        for case in calibrate(nlp_gait.load(name), shortest):
            m = case.measurements
            powers = " | ".join(f"{p.total_W:.3f} | {p.mechanical_W:.3f}, {p.heat_W:.3f}" for p in (m.predicted, m.measured))
            end = f"falls at {m.fell_at_s:.2f} s" if m.fell_at_s is not None else "stays up"
            pressure = "-" if m.pressure_rms_m is None else f"{1e3 * m.pressure_rms_m:.1f}"
            print(
                f"| {case.duration_s:.3f} | {powers} | {m.power_error:+.0%} | {pressure} | {m.largest_tilt_deg:.1f} | {end} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
