"""The positioning axis of EMPS, measured by others: dry friction is found and its free run is right."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from isojax import read_campaign
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
    loop = close_loop(
        read_campaign(tmp_path), max_iterations=1, excluded=tuple(sorted(set(CATALOGUE) - RIVALS))
    )
    (finding,) = loop.findings
    assert finding.effect == "coulomb_friction"
    # Falling friction contains it; what is no friction must be told from it.
    assert set(finding.indistinguishable) <= {"stribeck_friction"}
    # The mark for an open-loop free run of a model of four coefficients.
    assert loop.before.errors["fit"].rmse > 4e-3
    assert loop.after.errors["fit"].rmse <= 2.55e-3
    # Janot, Gautier & Brunot 2019: M 95.11 kg, Fv 203.5, Fc 20.39; from closed loop, where theirs fits best.
    model = loop.after.model
    assert float(model.mass) == pytest.approx(95.11, rel=0.03)
    assert float(model["linear_damping.coefficient"]) == pytest.approx(203.5, rel=0.15)
    assert float(model["coulomb_friction.force_level"]) == pytest.approx(20.39, rel=0.15)
