"""What is left by laws outside the catalogue: exponents, harmonics and ceilings, against the rig's truth."""

import dataclasses

import numpy as np
import pytest
from strange_laws import BASE, Grip, Machine

from isojax import RESULTS, rig
from isojax.identification import classical_guess, explain_remainder, fit, scales
from isojax.identification.remainder._ceiling import find_ceilings
from isojax.identification.remainder._dwell_remainder import split_dwells
from isojax.identification.remainder._exponents import find_exponents
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
    """What is left by damping |x| v: fit, latent forces, dwells."""
    found = fitted(Grip(5e6))
    latent = force_residuals(found)
    return found, latent, split_dwells(found, latent)


@pytest.mark.slow
def test_exponents_of_damping_that_grows_with_x_are_three_and_one(gripped):
    exponents = find_exponents(gripped[2])
    assert exponents is not None
    assert abs(exponents.amplitude - 3.0) < 3.0 * exponents.amplitude_error
    assert abs(exponents.frequency - 1.0) < 3.0 * exponents.frequency_error
    assert exponents.amplitude_error < 0.2
    assert exponents.damping > 0.7
    assert exponents.like[0] == "damping |x| v"


def test_latent_force_of_a_dwell_has_the_third_harmonic_of_the_hidden_law(gripped):
    # x = X cos p, v = -w X sin p: sin(3 p) of |cos p| sin p is (2/pi) int_0^pi |cos| sin sin(3 p) = 4/(5 pi).
    found, _, dwells = gripped
    largest = max((one for one in dwells if one.role == "fit"), key=lambda one: one.amplitude)
    omega = 2.0 * np.pi * largest.frequency
    hidden = 5e6 * largest.amplitude**2 * omega * 4.0 / (5.0 * np.pi)
    # What the declared |v|v and v^3 took over, wrongly: sin(3 p) of |sin|sin is -8/(15 pi), of sin^3 -1/4.
    model = found.model
    changes = (
        float(model["abs_quadratic_damping.coefficient"]) + 3.688e5,
        float(model["cubic_damping.coefficient"]) - 5.3753e6,
    )
    speed = omega * largest.amplitude
    taken = changes[0] * speed**2 * 8.0 / (15.0 * np.pi) + changes[1] * speed**3 * 0.25
    third = float(np.imag(largest.harmonics[3]))
    assert abs(third - (hidden + taken)) < 0.1 * hidden + 4.0 * largest.error[3]


def test_a_static_law_leaves_what_a_static_surface_explains(gripped):
    found, latent, _ = gripped
    static, black_box = find_ceilings(latent, scales(found.campaign))
    assert static.share > 0.8
    assert black_box.share > 0.7
    assert black_box.held_out


@pytest.mark.parametrize(
    "hidden", [rig.InputDelay(2e-3), rig.MaxwellBranch(2.5e5, 0.03)], ids=["delay", "memory"]
)
def test_delay_and_memory_leave_what_only_a_memory_explains(fitted, hidden):
    found = fitted(hidden)
    static, black_box = find_ceilings(force_residuals(found), scales(found.campaign))
    assert static.share < 0.55
    assert black_box.share > static.share + 0.3
    assert black_box.share > 0.7


@pytest.mark.slow
def test_broadband_records_are_described_without_dwells(fitted):
    plan = rig.Multisine((60.0, 110.0), 2.0, 12.0, holdout_levels=(80.0,))
    remainder = explain_remainder(fitted(Grip(1e7), plan=plan), refit=True)
    assert [law.formula for law in remainder.pursuit.laws] == ["|x| v"]
    assert abs(remainder.pursuit.laws[0].coefficient - 1e7) < 1e6
    assert remainder.pursuit.refitted < 1.05
    assert remainder.dwells == ()
    assert remainder.parts == {}
    assert remainder.exponents is None
    assert remainder.static.share > 0.7


@pytest.mark.slow
def test_a_machine_beside_the_bench_follows_no_motion(fitted):
    remainder = explain_remainder(fitted(Machine(6.0, 2.0 * np.pi * 11.3)), refit=False)
    assert remainder.pursuit.laws == ()
    assert remainder.parts["the rest"] > 0.8
    assert remainder.exponents is None
    assert abs(remainder.static.share) < 0.1
    assert abs(remainder.black_box.share) < 0.1


@pytest.mark.slow
def test_noise_leaves_nothing_to_describe(fitted):
    remainder = explain_remainder(fitted(), refit=False)
    assert remainder.pursuit.laws == ()
    assert remainder.exponents is None
    assert remainder.parts == {}
    assert np.isnan(remainder.static.share)
    assert np.isnan(remainder.black_box.share)


def test_what_no_other_samples_can_predict_has_no_ceiling(gripped):
    found, latent, _ = gripped
    record = latent[0].record
    whole = (dataclasses.replace(record.dwells[0], start=0, stop=record.time.size),)
    alone = latent[0]._replace(record=dataclasses.replace(record, dwells=whole))
    for ceiling in find_ceilings((alone,), scales(found.campaign)):
        assert np.isnan(ceiling.share)
        assert np.isnan(ceiling.error)


def test_a_failed_fit_is_refused(gripped):
    failed = gripped[0]._replace(result=RESULTS.not_converged)
    with pytest.raises(ValueError, match="must have succeeded"):
        explain_remainder(failed)
