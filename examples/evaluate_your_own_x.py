"""Judge a candidate of your own by the exact functions: here the point that a paper reports."""

import nlp_gait
from compare import evaluate

x = [0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.015, 4.0]
problem = nlp_gait.load("nao-ssp", robot="nao-v5")
verdict = evaluate(problem, x)
print(
    f"{verdict.objective['name']} {verdict.objective['value']:.6f} {verdict.objective['unit']}, feasible: {verdict.feasible}"
)
for name, value in verdict.indexes.items():
    print(
        f"  {name}: {value:.6f} on the problem's samples, {verdict.dense[name]:.6f} on {verdict.dense_intervals} intervals"
    )

too_high = evaluate(problem, [0.36, *x[1:]])
print("with the hip at 0.36 m:", *(f"\n  {row.name} by {row.violation:.3g}" for row in too_high.violations[:3]))
