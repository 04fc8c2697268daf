"""Two independent implementations of rigid-body dynamics agree."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

from tests.simulation.inverse_dynamics_oracle import engine_torques  # noqa: E402

# Both are double precision; what remains is rounding.
AGREEMENT_NM = 1e-9


@pytest.mark.parametrize(
    ("name", "options"),
    [("ssp optimum", {}), ("ssp ga", {"robot": "nao-v6"}), ("dsp optimum", {}), ("dsp pso", {"intervals": 20})],
)
def test_engine_and_model_need_the_same_torques(gait, name, options):
    result = gait(name, **options)
    signals = result.problem.signals(result.x)
    assert np.abs(signals.arrays["tau"]).max() > 1.0
    np.testing.assert_allclose(engine_torques(result, signals), signals.arrays["tau"], atol=AGREEMENT_NM)


@pytest.mark.parametrize("name", ["ssp optimum", "dsp optimum"])
def test_rotors_weigh_alike_in_plan_and_engine(gait, name):
    result, without = gait(name, motors="rotor"), gait(name)
    for one in (result, without):
        one.x[-1] = 0.5  # accelerations many times as large
    signals = result.problem.signals(result.x)
    np.testing.assert_allclose(engine_torques(result, signals), signals.arrays["tau"], atol=AGREEMENT_NM)
    assert np.abs(engine_torques(without, signals) - signals.arrays["tau"]).max() > 0.05
