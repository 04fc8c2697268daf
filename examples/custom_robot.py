"""A robot of your own: NAO with a heavier torso, as a file that extends a robot of the package."""

import json
import tempfile
from pathlib import Path

import nlp_gait
from nlp_gait.robots import load_robot

torso = load_robot("nao-v5").links["torso"]
heavy = {
    "schema": 1,
    "name": "nao-with-a-load",
    "extends": "nao-v5",
    "description": "NAO V5 with half a kilogram more at the torso's centre of mass",
    "sources": {"links": "this example"},
    "links": {
        "torso": {
            "mass_kg": torso.mass_kg + 0.5,
            "com_m": list(torso.com_m),
            "inertia_com_kgm2": list(torso.inertia_com_kgm2),
        }
    },
}
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "heavy.json"
    path.write_text(json.dumps(heavy))
    for robot in ("nao-v5", str(path)):
        solution = nlp_gait.solve(nlp_gait.load("nao-ssp", robot=robot), starts=2, seed=0)
        print(f"{load_robot(robot).name}: {solution.objective:.6f} W, {solution.status}")
