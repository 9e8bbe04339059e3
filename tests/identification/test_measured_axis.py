"""The positioning axis of EMPS, measured by others: dry friction is found and its free run is right."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from isojax import Integrator, fit, read_campaign
from isojax.elements import CATALOGUE
from isojax.identification import close_loop
from measured import EMPS

RIVALS = {
    "coulomb_friction",
    "stribeck_friction",
    "abs_quadratic_damping",
}
"""Effects that are weighed here; the whole catalogue is in the benchmark of measured records."""


@pytest.mark.slow
def test_dry_friction_is_found_and_the_axis_followed_without_a_spring_to_hold_it(shared_data, tmp_path):
    declaration = EMPS.format(data=shared_data.as_posix(), settle=2000)
    (tmp_path / "campaign.toml").write_text(declaration, encoding="utf-8")
    campaign = read_campaign(tmp_path)
    loop = close_loop(campaign, max_iterations=1, excluded=tuple(sorted(set(CATALOGUE) - RIVALS)))
    (finding,) = loop.findings
    assert finding.effect == "coulomb_friction"
    # Falling friction contains it; what is no friction must be told from it.
    assert set(finding.indistinguishable) <= {"stribeck_friction"}
    # Janot, Gautier & Brunot 2019, from closed loop: M 95.11 kg, Fv 203.5, Fc 20.39.
    model = loop.after.model
    assert float(model.mass) == pytest.approx(95.11, rel=0.01)
    assert float(model["linear_damping.coefficient"]) == pytest.approx(203.5, rel=0.05)
    assert float(model["coulomb_friction.force_level"]) == pytest.approx(20.39, rel=0.05)
    # The random force takes up what makes a free run drift. Fitted to the free run, four coefficients reach
    # the published error.
    assert loop.before.errors["fit"].rmse > loop.after.errors["fit"].rmse
    assert fit(model, campaign, integrator=Integrator()).errors["fit"].rmse <= 2.55e-3
