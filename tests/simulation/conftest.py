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


@pytest.fixture(scope="session")
def gait():
    """Result by name."""

    def make(name, **options):
        problem_name, x = GAITS[name]
        problem = nlp_gait.load(problem_name, **options)
        return Result(problem=problem, x=problem.check_x(x))

    return make
