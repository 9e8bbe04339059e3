"""Description of what laws outside the catalogue leave unexplained, compared with the rig's truth."""

import numpy as np
import pytest
from strange_laws import BASE, Grip, Machine

from isojax import RESULTS, rig
from isojax.identification import classical_guess, explain_remainder, fit
from isojax.identification.remainder._dwell_remainder import dwell_remainders
from isojax.identification.remainder._force_residual import force_residuals

FREQUENCIES = tuple(np.arange(4.0, 6.6, 0.25))
DWELLS = rig.SteppedSine((40.0, 80.0, 130.0), FREQUENCIES, directions=("forward",), holdout_levels=(100.0,))


@pytest.fixture(scope="module")
def fitted(simulated):
    """Gives the function that fits the declared model to a plant with hidden effects."""

    def run(*hidden, plan=DWELLS, **options):
        campaign = simulated(rig.Plant(BASE).plus(*hidden), plan, **options)
        return fit(classical_guess(campaign).model, campaign)

    return run


@pytest.fixture(scope="module")
def gripped(fitted):
    """Fit to a plant with hidden damping |x| v, and its dwells."""
    found = fitted(Grip(5e6))
    return found, dwell_remainders(found, force_residuals(found))


def test_force_residual_of_a_dwell_has_the_third_harmonic_of_the_hidden_law(gripped):
    # x = X cos p, v = -w X sin p: sin(3 p) of |cos p| sin p is (2/pi) int_0^pi |cos| sin sin(3 p) = 4/(5 pi).
    found, dwells = gripped
    largest = max((one for one in dwells if one.role == "fit"), key=lambda one: one.amplitude)
    omega = 2.0 * np.pi * largest.frequency
    hidden = 5e6 * largest.amplitude**2 * omega * 4.0 / (5.0 * np.pi)
    # What the declared |v|v and v^3 absorb, wrongly: sin(3 p) of |sin|sin is -8/(15 pi), of sin^3 -1/4.
    model = found.model
    changes = (
        float(model["abs_quadratic_damping.coefficient"]) + 3.688e5,
        float(model["cubic_damping.coefficient"]) - 5.3753e6,
    )
    speed = omega * largest.amplitude
    taken = changes[0] * speed**2 * 8.0 / (15.0 * np.pi) + changes[1] * speed**3 * 0.25
    third = float(np.imag(largest.harmonics[3]))
    assert abs(third - (hidden + taken)) < 0.1 * hidden + 4.0 * largest.error[3]


@pytest.mark.slow
def test_broadband_records_are_described_without_dwells(fitted):
    plan = rig.Multisine((60.0, 110.0), 2.0, 12.0, holdout_levels=(80.0,))
    remainder = explain_remainder(fitted(Grip(1e7), plan=plan), refit=True)
    assert [law.formula for law in remainder.pursuit.laws] == ["|x| v"]
    assert abs(remainder.pursuit.laws[0].coefficient - 1e7) < 1e6
    assert remainder.pursuit.refitted < 1.05
    assert remainder.dwells == ()


@pytest.mark.slow
def test_a_machine_beside_the_bench_follows_no_motion(fitted):
    remainder = explain_remainder(fitted(Machine(6.0, 2.0 * np.pi * 11.3)), refit=False)
    assert remainder.pursuit.laws == ()
    assert remainder.pursuit.chi2_per_dof > 1.1


@pytest.mark.slow
def test_noise_leaves_nothing_to_describe(fitted):
    remainder = explain_remainder(fitted(), refit=False)
    assert remainder.pursuit.laws == ()
    assert len(remainder.dwells) == 4 * len(FREQUENCIES)
    # In units of its standard error by the noise, either component of a harmonic has variance one.
    scaled = [one.harmonics[2:6] / one.error[2:6] for one in remainder.dwells]
    assert np.mean(np.abs(scaled) ** 2) == pytest.approx(2.0, rel=0.3)


def test_a_failed_fit_is_refused(gripped):
    failed = gripped[0]._replace(result=RESULTS.not_converged)
    with pytest.raises(ValueError, match="must have succeeded"):
        explain_remainder(failed)
