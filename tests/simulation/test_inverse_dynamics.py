"""Two independent implementations of rigid-body dynamics agree."""

import numpy as np
import pytest

from nlp_gait.formulation import Array, Result, Signals
from nlp_gait.gaits.nao.body import GRAVITY

pytest.importorskip("mujoco")

from tests.simulation.inverse_dynamics_oracle import standing_on  # noqa: E402

# Both are double precision; what remains is rounding.
AGREEMENT_NM = 1e-9


def engine_torques(result: Result, signals: Signals) -> Array:
    return standing_on(result.problem.display.simulation_model.robot, GRAVITY, "left", signals)[0]


@pytest.mark.parametrize(("name", "options"), [("ssp optimum", {}), ("ssp ga", {"robot": "nao-v6"})])
def test_engine_and_model_need_the_same_torques(gait, name, options):
    result = gait(name, **options)
    signals = result.problem.signals(result.x)
    assert np.abs(signals.arrays["tau"]).max() > 1.0
    np.testing.assert_allclose(engine_torques(result, signals), signals.arrays["tau"], atol=AGREEMENT_NM)
