"""The cheapest welded beam, a problem of your own: `nlp-gait certainty welded_beam.py:beam` proves its optimum in a second."""

from casadi import SX, sqrt

import nlp_gait

h, w, t, b = (SX.sym(name) for name in ("h", "l", "t", "b"))  # weld's height and length, beam's height and width
R, direct = sqrt(w**2 / 4 + ((h + t) / 2) ** 2), 6000 / (sqrt(2) * h * w)
torsion = 6000 * (14 + w / 2) * R / (2 * sqrt(2) * h * w * (w**2 / 12 + ((h + t) / 2) ** 2))
shear, bending, deflection = (
    sqrt(direct**2 + direct * torsion * w / R + torsion**2),
    504000 / (b * t**2),
    2.1952 / (t**3 * b),
)
buckling = 4.013 * 30e6 * t * b**3 / 6 / 14**2 * (1 - t / 28 * sqrt(30e6 / 4 / 12e6))
cost = 1.10471 * h**2 * w + 0.04811 * t * b * (14 + w)
limits = {
    "shear": shear <= 13600,
    "bending": bending <= 30000,
    "weld": h <= b,
    "deflection": deflection <= 0.25,
    "buckling": buckling >= 6000,
}
beam = nlp_gait.problem(
    cost, limits, x={"h": (0.125, 2, "in"), "l": (0.1, 10, "in"), "t": (0.1, 10, "in"), "b": (0.1, 2, "in")}, unit="USD"
)
