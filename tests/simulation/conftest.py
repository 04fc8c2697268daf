"""Gaits to simulate."""

import pytest

import nlp_gait
from nlp_gait.formulation import Result

GAITS = {
    # Gupta, Pratihar, Deb (2023), Table 6, and our optimum to the digits that the documentation prints.
    "ssp optimum": ("nao-ssp", (0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4)),
    "ssp pso": ("nao-ssp", (0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.015, 4)),
    "ssp ga": ("nao-ssp", (0.31, -0.005, 0, 0.0031, 0.0017, 0.0364, -0.0135, 0.015, 4)),
    # Table 8.
    "dsp optimum": ("nao-dsp", (0.31, 0.00683, 0.00007, 0.00485, 0.06828, -0.05291, -0.02170, 2)),
    "dsp pso": ("nao-dsp", (0.31, -0.0008, -0.0055, 0.052, 0.001, -0.0367, -0.0424, 2)),
    # The hip swings out over the left edge of the support foot.
    "ssp falling": ("nao-ssp", (0.31, -0.00122, 0.00350, 0.01243, 0.001, 0.12, -0.12, 0.015, 4)),
}

# The least energy per metre, 19.149 J/m, to five digits; hip at lift-off, arms, hip at touch-down, arms, swing, times, step.
CHEAPEST = (0.0019, 0.02108, 0.31, 0.09951, 0.09805, -0.01255, 0.0, 0.0)
CHEAPEST += (0.04492, 0.0234, 0.30827, 0.09796, -0.05736, 0.02148, 0.0, 0.0, 0.015, 0.4, 0.56565, 0.07619)


@pytest.fixture(scope="session")
def gait():
    """Result by name."""

    def make(name, **options):
        problem_name, x = GAITS[name]
        problem = nlp_gait.load(problem_name, **options)
        return Result(problem=problem, x=problem.check_x(x))

    return make


@pytest.fixture(scope="session")
def cycle() -> Result:
    """The cheapest cycle of NAO."""
    problem = nlp_gait.load("nao-cycle")
    return Result(problem=problem, x=problem.check_x(CHEAPEST))
