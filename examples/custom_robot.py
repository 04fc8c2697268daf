"""
Your own robot
==============

A robot is a file: JSON that may extend a robot of the package, or URDF or MJCF for any biped with six-joint legs.
Here NAO carries an increasing load at its torso, which changes the cheapest step.
"""

import json
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import nlp_gait
from nlp_gait.robots import load_robot

# %%
# Three robots that differ in the mass of the torso; each file overrides one table of NAO V5.

torso = load_robot("nao-v5").links["torso"]
loads_kg, powers = (0.0, 0.5, 1.0), []
with tempfile.TemporaryDirectory() as folder:
    for load_kg in loads_kg:
        loaded = {
            "schema": 1,
            "name": "nao-with-a-load",
            "extends": "nao-v5",
            "description": "NAO V5 with more mass at the torso's centre of mass",
            "sources": {"links": "this example"},
            "links": {
                "torso": {
                    "mass_kg": torso.mass_kg + load_kg,
                    "com_m": list(torso.com_m),
                    "inertia_com_kgm2": list(torso.inertia_com_kgm2),
                }
            },
        }
        path = Path(folder) / f"loaded-{load_kg:g}.json"
        path.write_text(json.dumps(loaded))
        solution = nlp_gait.solve(nlp_gait.load("nao-ssp", robot=str(path)), starts=1, seed=0)
        powers.append(solution.objective)
        print(f"{load_robot(str(path)).name}: {load_kg:g} kg, {solution.objective:.6f} W, {solution.status}")

# %%
# Power rises with the load.

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(loads_kg, powers, "o-")
axes.set(xlabel="load at the torso [kg]", ylabel="least power [W]")
