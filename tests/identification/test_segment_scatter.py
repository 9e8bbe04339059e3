"""Stiffness that scatters from dwell to dwell: told by repeats, and taken for no effect."""

import dataclasses
from pathlib import Path

import numpy as np
import optimistix as optx
import pytest
from strange_laws import BASE, RestlessSpring

from isojax import rig
from isojax.elements import (
    AbsQuadraticDamping,
    AbsQuadraticStiffness,
    CubicDamping,
    CubicStiffness,
    LinearDamping,
    LinearStiffness,
)
from isojax.identification import Rules, fit, scales
from isojax.identification.diagnosis._refit import refit_to_convergence
from isojax.identification.diagnosis._score import absent_effects, score_test
from isojax.identification.fitting._elimination import Nuisances, Reduced, Spread
from isojax.identification.fitting._problem import Point
from isojax.identification.fitting._search import Search
from isojax.identification.fitting._segment_scatter import segment_scatter
from isojax.identification.jacobian._segments import Segment
from isojax.identification.jacobian._unknowns import STIFFNESS_SCALE_UNIT
from isojax.identification.remainder._dwell_remainder import dwell_remainders
from isojax.identification.remainder._force_residual import force_residuals
from isojax.models import Isolator
from isojax.records import Dwell, Record

PLAN = rig.SteppedSine((40.0, 80.0, 120.0), tuple(np.arange(4.2, 6.3, 0.3)), 12, repeats=2)
BENCH = rig.Bench(rate=250.0, noise=5e-3, drift=3e-4, force_noise=0.0, anti_alias=False, tolerance=1e-7)
START = Isolator(
    800.0,
    (
        LinearStiffness(1.0805e6),
        AbsQuadraticStiffness(-6.974e8),
        CubicStiffness(2.51667e11),
        LinearDamping(1.027e4),
        AbsQuadraticDamping(-3.688e5),
        CubicDamping(5.3753e6),
    ),
)
DWELLS, LENGTH = 300, 10


@pytest.mark.slow
def test_scatter_from_dwell_to_dwell_is_told_by_repeats_and_taken_for_no_effect(simulated, monkeypatch):
    plant = rig.Plant(BASE).plus(RestlessSpring.of(PLAN, 1.0805e6, 1e-3, 2, BENCH))
    campaign = simulated(plant, PLAN, 2, BENCH)
    magnitudes = scales(campaign)

    def surest(found):
        test = score_test(found.estimate, Search(magnitudes), absent_effects(found.model, magnitudes))
        return min(score.p_value for score in test.scores)

    found = fit(START, campaign)
    # Of 42 dwells a standard deviation is known to a tenth, and half of what is seen of it is noise.
    assert found.stats.segment_scatter == pytest.approx(1e-3, rel=0.4)
    assert found.stats.chi2 / found.stats.dof == pytest.approx(1.0, abs=0.02)
    assert surest(found) > 0.05
    # Nor is it described as a force that follows the displacement.
    dwells = dwell_remainders(found, force_residuals(found))
    in_phase = [one.harmonics[1].real / one.error[1] for one in dwells]
    assert np.mean(np.square(in_phase)) == pytest.approx(1.0, abs=0.3)
    # With one stiffness for all dwells of a record the same campaign lacks something beyond any doubt.
    monkeypatch.setattr("isojax.identification.fitting._estimate.segment_scatter", lambda *arguments: 0.0)
    assert surest(fit(START, campaign)) < 1e-20


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 3])
def test_what_scatters_within_records_counts_no_second_time_between_them(seed, simulated):
    bench = dataclasses.replace(BENCH, drift=0.0)
    plant = rig.Plant(BASE).plus(RestlessSpring.of(PLAN, 1.0805e6, 1e-3, seed, bench))
    assert fit(START, simulated(plant, PLAN, seed, bench)).stats.stiffness_scatter < 2e-4


@pytest.mark.slow
def test_scatter_that_a_wrong_model_showed_is_given_up_with_the_finding(simulated):
    campaign = simulated(rig.Plant(BASE), PLAN, 2, BENCH)
    right = fit(START, campaign)
    assert right.stats.segment_scatter == 0.0
    old = right.estimate.point.nuisances
    moved = old._replace(spread=Spread(old.spread.records, 1e-3), segments=old.segments + 1e-3)
    wrong = right.estimate._replace(point=right.estimate.point._replace(nuisances=moved))
    again = refit_to_convergence(wrong, Search(scales(campaign), solver=optx.LevenbergMarquardt(1e-3, 1e-3)))
    assert again.point.nuisances.spread.segments == 0.0
    np.testing.assert_array_equal(again.point.nuisances.segments, 0.0)
    np.testing.assert_allclose(
        again.uncertainty.standard_error, right.estimate.uncertainty.standard_error, 1e-3
    )


def _record(repeat, drive, output, direction="forward", dwells=()):
    time = np.arange(drive.size) / 100.0
    name = f"{direction} {repeat}"
    signals = (drive, output, drive, output)
    about = {"level": 1.0, "direction": direction, "repeat": repeat, "dwells": dwells}
    return Record(name, Path(f"{name}.npz"), time, 100.0, *signals, **about)


def _told(
    scatter, alike=True, direction="forward", branch=1.0, seed=5, stepped=False, assumed=1.0, known=0.0
):
    """What two repeats tell that differ by a record's scatter, by that of dwells, and by noise.

    The noise is taken to be `assumed` of what it is, and the share `known` of each deviation is already in
    the model.
    """
    draw = np.random.default_rng(seed)
    drive = draw.standard_normal(DWELLS * LENGTH)
    other = drive if alike else draw.standard_normal(drive.size)
    # The second record of a stepped sine was started by hand, a little earlier or later.
    shift = 0 if not stepped else 3
    starts = [LENGTH * dwell for dwell in range(DWELLS)]
    stops = [min(start + LENGTH, drive.size - 5) for start in starts]
    dwells = [
        tuple(
            Dwell(start + late, stop + late, 4.0 + 0.01 * number, 5.0)
            for number, (start, stop) in enumerate(zip(starts, stops, strict=True))
        )
        for late in (0, shift)
    ]
    drive, other = (np.sin(one) for one in (drive, other)) if stepped else (drive, other)
    shifted = np.roll(other, shift)
    records = (
        _record(0, drive, drive, dwells=dwells[0] if stepped else ()),
        _record(1, shifted, branch * shifted, direction, dwells[1] if stepped else ()),
    )
    segments = tuple(
        Segment(place, start + late, stop + late, start + late)
        for place, late in enumerate((0, shift))
        for start, stop in zip(starts, stops, strict=True)
    )
    # What the model lacks moves both repeats of a dwell alike, and by much more than anything else.
    apparent = np.tile(5e-2 * draw.standard_normal(DWELLS), 2) + np.repeat([2e-3, -1e-3], DWELLS)
    apparent += scatter * draw.standard_normal(apparent.size)
    noise = 1e-3 * draw.uniform(0.2, 2.0, apparent.size)
    apparent += noise * draw.standard_normal(apparent.size)
    information = (STIFFNESS_SCALE_UNIT / (assumed * noise)) ** 2
    left = (1.0 - known) * apparent / STIFFNESS_SCALE_UNIT
    by_segment = np.zeros((information.size, 2, 2))
    by_segment[:, 0] = np.stack([information, information * left], axis=1)
    lanes = len(segments)
    nothing = np.zeros((lanes, 0))
    reduced = Reduced(
        np.zeros((2, 1, 1)),
        np.zeros(2),
        np.zeros(0),
        np.zeros((2, 1)),
        np.ones(2),
        np.zeros((lanes, 0, 2)),
        np.zeros((0, 2)),
        np.zeros(0),
        by_segment,
        np.zeros(lanes),
    )
    own = known * apparent / STIFFNESS_SCALE_UNIT
    nuisances = Nuisances(nothing, np.zeros(2), own, Spread(1e-2))
    point = Point(START, nuisances, reduced, np.ones(2))
    return segment_scatter(records, segments, point, assumed**-2, Rules())


@pytest.mark.parametrize(("scatter", "within"), [(5e-4, 0.2), (1e-3, 0.1), (4e-3, 0.05)])
def test_differences_of_repeats_tell_their_scatter_whatever_the_model_lacks(scatter, within, unchecked):
    found = [_told(scatter, seed=seed) for seed in range(20)]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(scatter, rel=within)


def test_without_scatter_or_without_repeats_there_is_none(unchecked):
    assert sum(_told(0.0, seed=seed) > 0.0 for seed in range(100)) <= 4
    assert _told(4e-3, direction="backward") == 0.0
    # Another drive is another test, another amplitude another branch.
    assert _told(4e-3, alike=False) == 0.0
    assert _told(4e-3, branch=1.2) == 0.0
    assert _told(4e-3, branch=1.2, stepped=True) == 0.0


def test_noise_that_is_larger_than_declared_is_no_scatter(unchecked):
    assert sum(_told(0.0, seed=seed, assumed=0.7) > 0.0 for seed in range(100)) <= 4
    assert _told(4e-3, assumed=0.7) == pytest.approx(4e-3, rel=0.15)


def test_deviations_that_the_model_already_has_count():
    assert _told(1e-3, known=0.8) == pytest.approx(_told(1e-3), rel=1e-9)


def test_dwells_are_matched_by_their_frequency_wherever_they_begin():
    assert _told(4e-3, stepped=True) == pytest.approx(4e-3, rel=0.15)
