"""The shape that a finding was taken with is freed before another effect may make up for it."""

import pytest

from isojax import rig
from isojax._parameters import list_parameters
from isojax.identification import close_loop

PLAN = rig.Multisine((40.0, 80.0, 140.0), 2.0, 14.0, period=2.0, periods=5, lines="full")
BENCH = rig.Bench(rate=250.0, noise=3e-3, drift=0.0, force_noise=0.0, anti_alias=False, tolerance=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("exponent", [1.0, 1.8])
def test_the_exponent_of_a_hysteresis_loop_is_freed_where_it_is_not_one(simulated, exponent):
    beta = 0.8e3**exponent
    loop = rig.BoucWen(3e5, beta, -0.9 * beta, exponent)
    plant = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4), loop))
    campaign = simulated(plant, PLAN, 3, BENCH, stiffness=("linear",), damping=("linear",))
    found = close_loop(campaign)
    assert [finding.effect for finding in found.findings] == ["bouc_wen"]
    assert found.verdict == "found"
    assert ("bouc_wen.exponent" in found.after.free) == (exponent != 1.0)
    number = {entry.name: float(entry.value) for entry in list_parameters(found.after.model)}
    error = found.after.standard_errors.get("bouc_wen.exponent", 1e-12)
    assert abs(number["bouc_wen.exponent"] - exponent) < 4.0 * error
