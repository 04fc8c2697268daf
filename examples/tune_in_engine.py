"""
A search on the physics engine
==============================

NAO's walking cycle, scored by the energy of the drives per metre in MuJoCo (extra `sim`).
"""

import nlp_gait
from metaheuristics import ParticleSwarm, minimize
from nlp_gait.simulation.objective import Arena, EngineObjective

# %%
# The optimum of the model is the mark to beat.

optimum = nlp_gait.solve("nao-cycle", starts=3)

# %%
# An arena simulates a few steps of each candidate.

arena = Arena(nlp_gait.load("nao-cycle"), steps=2)
found = minimize(EngineObjective([arena], threads=2), ParticleSwarm(population=10), evaluations=20, seed=0)

# %%
# Twenty evaluations only show how it is called.

print(
    f"IPOPT: {arena.score(optimum.best.x).J_per_m:.2f} J/m; PSO: {found.objective:.2f} J/m, violation {found.violation:.2g}"
)

figure = optimum.plot()
figure
