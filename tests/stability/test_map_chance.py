"""Chances of the cells of a map, against an independent table of folds and closed forms."""

from types import SimpleNamespace
from typing import NamedTuple

import diffrax
import numpy as np
import pytest
from scipy.stats import norm

import isojax as ij
from isojax.stability.map._chance import chance_words

SUCCESS = ij.RESULTS.promote(diffrax.RESULTS.successful)
PAPER = ij.paper.y_direction()
FOLDS = {4.0: (211.67, 211.31), 4.2: (178.12, 171.89), 4.4: (150.66, 144.52)}
"""Frequency [Hz] to upper and lower fold [N], found by others to 0.01 N."""

SHARE = 0.02


class Fitted(NamedTuple):
    """What a map asks of a fit."""

    model: ij.Isolator
    free: tuple[str, ...]
    covariance: np.ndarray
    result: ij.RESULTS


def scaled_map(model, force, frequencies, share=SHARE, like=PAPER):
    """Mass and every coefficient grow together by a standard deviation: all forces grow with them."""
    numbers = {entry.name: float(entry.value) for entry in like.parameters}
    covariance = share**2 * np.outer(list(numbers.values()), list(numbers.values()))
    fit = Fitted(model, tuple(numbers), covariance, SUCCESS)
    return ij.stability_map(model, force, np.array(frequencies), fit=fit)


def scaled_folds(force, frequency, share=SHARE):
    upper, lower = FOLDS[frequency]
    return norm.cdf((force / lower - 1.0) / share) - norm.cdf((force / upper - 1.0) / share)


@pytest.fixture(scope="module")
def smap():
    return scaled_map(PAPER, np.linspace(120.0, 240.0, 121), list(FOLDS))


def test_the_chance_of_several_orbits_is_that_of_the_scaled_folds(smap):
    force = np.asarray(smap.amplitudes)
    for column, frequency in enumerate(FOLDS):
        expected = scaled_folds(force, frequency)
        found = np.asarray(smap.probability_coexisting)[:, column]
        # At 4 Hz, beside the cusp, the lens is 0.36 N high, a third of a cell.
        np.testing.assert_allclose(found, expected, atol=0.01)
    assert smap.chance_error < 0.01
    assert "a chance near a half is off by about" in str(smap)


def test_a_chance_that_is_off_says_so():
    """Where the error of the forces is a fifth, quadratics between the maps no longer hold."""
    found = scaled_map(PAPER, np.linspace(100.0, 320.0, 111), [4.2], share=0.2)
    force, several = np.asarray(found.amplitudes), np.asarray(found.probability_coexisting)[:, 0]
    off = np.nanmax(np.abs(several - scaled_folds(force, 4.2, share=0.2)))
    assert max(off, 0.02) < found.chance_error < 0.2


def test_so_it_is_where_the_lens_is_lower_than_a_row():
    found = scaled_map(PAPER, np.linspace(140.0, 212.0, 9), [4.0, 4.2])
    several = np.asarray(found.probability_coexisting)
    for column, frequency in enumerate((4.0, 4.2)):
        expected = scaled_folds(np.asarray(found.amplitudes), frequency)
        np.testing.assert_allclose(several[:, column], expected, atol=0.01)


def test_so_it_is_where_orbits_cannot_be_read_off_a_surface():
    # A branch of 1 N/m moves no fold, but gives the model an internal state.
    branch = ij.elements.MaxwellBranch(stiffness=1.0, time_constant=0.1)
    model = ij.Isolator(PAPER.mass, (*PAPER.elements, branch))
    found = scaled_map(model, np.linspace(130.0, 210.0, 41), [4.2])
    expected = scaled_folds(np.asarray(found.amplitudes), 4.2)
    np.testing.assert_allclose(found.probability_coexisting[:, 0], expected, atol=0.03)


def test_so_it_is_under_dry_friction_and_what_begins_to_slide_is_stable():
    elements = ij.elements
    laws = elements.LinearStiffness(3e5), elements.CubicStiffness(4e10), elements.LinearDamping(360.0)
    model = ij.Isolator(120.0, (*laws, elements.CoulombFriction(6.0, width=1e-4)))
    # Where branches that are split at each reversal have their folds at 80 N.
    folds = 9.229747, 10.890493
    force = np.concatenate([np.linspace(7.0, 12.0, 8), np.linspace(74.0, 86.0, 13)])
    found = scaled_map(model, force, [6.2, *folds], like=model)
    above = norm.cdf((force / 80.0 - 1.0) / SHARE)
    expected = np.stack([0.0 * force, np.where(force > 50.0, 1.0 - above, 0.0), above], axis=1)
    np.testing.assert_allclose(found.probability_coexisting, expected, atol=0.01)
    np.testing.assert_allclose(found.probability_stable, 1.0 - expected, atol=0.01)


def test_cells_that_friction_holds_are_counted_among_the_stable_ones():
    stable = np.array([[1.0, 1.0, np.nan], [1.0, 0.5, 0.0]])
    held = np.array([[True, True, True], [False, False, False]])
    smap = SimpleNamespace(
        probability_stable=stable, probability_coexisting=0.0 * stable, chance_error=np.nan, held=held
    )
    words = "stable: at least 95 % in 3 cells (in 2 of them dry friction holds the mass), uncertain in 1"
    assert chance_words(smap).startswith(f"{words}, unknown in 1")


def test_a_cell_is_stable_where_it_holds_one_orbit(smap):
    several = np.asarray(smap.probability_coexisting)
    np.testing.assert_allclose(smap.probability_stable, 1.0 - several, atol=0.005)


def test_the_standard_error_of_a_response_is_that_of_the_scaled_force(smap):
    # The orbit depends on force over scale alone: its error is that of a force that is 2 % uncertain.
    force, response = np.asarray(smap.amplitudes), np.asarray(smap.response)
    place = slice(3, 12)
    slope = np.gradient(response, force, axis=0)
    expected = SHARE * force[place, None] * slope[place]
    np.testing.assert_allclose(smap.standard_errors["response"][place], expected, rtol=0.02)
    # The error is unknown where the folds may pass.
    assert np.isnan(np.asarray(smap.standard_errors["response"])[55, 1])


def test_a_map_draws_its_chances(smap):
    assert "stable with 95%" in [text.get_text() for text in _legend(ij.plot.stability_map(smap))]


def _legend(figure):
    return [text for legend in figure.legends for text in legend.get_texts()] + [
        text for ax in figure.axes if ax.get_legend() for text in ax.get_legend().get_texts()
    ]


def test_on_a_coarse_grid_orbits_near_escape_spoil_no_fold():
    """Of a softening spring: no table knows the motion up there, but all of it around the folds."""
    laws = [ij.LinearStiffness(4e4), ij.CubicStiffness(-2e8), ij.LinearDamping(60.0)]
    softening = ij.Isolator(10.0, laws)
    frequency, share = 0.8 * (4e3**0.5) / (2.0 * np.pi), 0.05
    branch = ij.continue_branch(softening, parameter="amplitude", frequency=frequency, start=10.0, stop=120.0)
    lower, upper = sorted(float(one.amplitude) for one in branch.special_points if one.kind == "fold")
    found = scaled_map(
        softening, np.linspace(25.0, 400.0, 14), [frequency, 1.1 * frequency], share, softening
    )
    force, several = np.asarray(found.amplitudes), np.asarray(found.probability_coexisting)[:, 0]
    expected = norm.cdf((force / lower - 1.0) / share) - norm.cdf((force / upper - 1.0) / share)
    assert np.any((expected > 0.1) & (expected < 0.9))
    np.testing.assert_allclose(several, expected, atol=0.01)
