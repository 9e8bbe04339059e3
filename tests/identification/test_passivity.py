"""A force with internal states must take energy over the loop that the motion drives it around."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from strange_laws import BASE

import isojax as ij
from isojax import rig
from isojax.elements import (
    CATALOGUE,
    BoucWen,
    CubicStiffness,
    DahlFriction,
    MaxwellBranch,
    Scales,
    SecondMode,
)
from isojax.identification.diagnosis._admissibility import find_violation, visited_range
from isojax.identification.diagnosis._passivity import find_activity, work_per_cycle
from isojax.identification.guess._force_balance import with_strength

AMPLITUDE = np.array([2e-4, 1e-3])
ANGULAR = np.array([20.0, 35.0])
SCALES = Scales(800.0, 150.0, 1e-3, 0.03, 1.0, 30.0, 1e-3, 0.01, 1.0)


def test_a_maxwell_branch_takes_the_energy_of_its_loss_modulus():
    stiffness, lag = 3e4, 0.04
    work, _ = work_per_cycle(MaxwellBranch(stiffness, lag), AMPLITUDE, ANGULAR)
    phase = ANGULAR * lag
    # Six cycles are eleven decay times and more.
    np.testing.assert_allclose(work, math.pi * stiffness * phase / (1 + phase**2) * AMPLITUDE**2, rtol=1e-4)


def test_dahl_friction_takes_the_energy_of_its_closed_loop():
    """Loading obeys dw/dx = (1 - w) / xd, so that w = 1 - (1 + tanh(X/xd)) exp(-(x + X)/xd)."""
    level, presliding = 7.0, 3e-4
    work, _ = work_per_cycle(DahlFriction(level, presliding), AMPLITUDE, ANGULAR)
    ends = np.tanh(AMPLITUDE / presliding)
    lost = (1 + ends) * presliding * (1 - np.exp(-2 * AMPLITUDE / presliding))
    np.testing.assert_allclose(work, 2 * level * (2 * AMPLITUDE - lost), rtol=1e-3)


@pytest.mark.parametrize("share", [0.7, 0.93, 1.08, 1.6])
def test_an_undamped_attached_mass_that_still_rings_is_no_source_of_energy(share):
    """From rest it has gained what it holds, never less than nothing; single cycles of the beat give back."""
    law = SecondMode(40.0, share * 30.0, 0.0)
    assert find_activity(law, 1e-3, 0.03) is None
    work, _ = work_per_cycle(law, np.array([1e-3]), np.array([30.0]))
    x, v = scipy_ringing(share * 30.0, 1e-3, 30.0, 6 * 2 * np.pi / 30.0)
    # At the end of a cycle the isolator is at its centre.
    np.testing.assert_allclose(6 * work, 0.5 * 40.0 * (v**2 + (share * 30.0 * x) ** 2), rtol=2e-2)


def scipy_ringing(own: float, size: float, omega: float, end: float) -> tuple[float, float]:
    """Displacement and velocity of an undamped attached mass, driven from rest."""
    solution = solve_ivp(
        lambda t, y: [y[1], own**2 * (size * math.sin(omega * t) - y[0])],
        (0.0, end),
        [0.0, 0.0],
        rtol=1e-9,
        atol=1e-12,
    )
    return float(solution.y[0, -1]), float(solution.y[1, -1])


def test_a_bouc_wen_law_without_beta_is_a_spring_and_takes_nothing():
    work, elastic = work_per_cycle(BoucWen(5e4, 0.0, 300.0, 1.0), AMPLITUDE, ANGULAR)
    assert np.all(np.abs(work) < 1e-4 * elastic)


def test_the_truth_of_the_bouc_wen_benchmark_is_admissible():
    """M. Schoukens and J.-P. Noel, Three benchmarks addressing open challenges, 2017, sec. 4."""
    assert find_activity(BoucWen(5e4, 800.0, -1100.0, 1.0), 1.5e-3, 0.3) is None


def test_a_loop_run_backwards_feeds_energy_in():
    sentence = find_activity(BoucWen(5e4, -100.0, 0.0, 1.0), 1e-3, 0.03)
    assert sentence is not None
    assert "feeds energy" in sentence


def test_a_memory_that_blows_up_is_refused():
    sentence = find_activity(BoucWen(5e4, -1e5, 0.0, 1.0), 1e-3, 0.03)
    assert sentence is not None
    assert "diverges" in sentence


def test_shape_parameters_that_cancel_are_refused_although_the_loop_takes_energy():
    law = BoucWen(5e4, 1e5, -0.995e5, 1.0)
    work, _ = work_per_cycle(law, AMPLITUDE, ANGULAR)
    assert np.all(work > 0.0)
    sentence = find_activity(law, 1e-3, 0.03)
    assert sentence is not None
    assert "cancel" in sentence
    # The same ratio at a motion so small that the loop has no knee is a plain spring with slight losses.
    assert find_activity(law, 1e-5, 3e-4) is None


@pytest.mark.parametrize("kind", CATALOGUE.values(), ids=CATALOGUE.keys())
def test_every_catalogue_shape_takes_energy_at_positive_strength(kind):
    for probe in kind.grid(SCALES):
        assert find_activity(with_strength(probe, probe.typical_strength(SCALES)), 1e-3, 0.03) is None


def test_a_law_without_memory_is_not_asked():
    assert find_activity(CubicStiffness(-1e12), 1e-3, 0.03) is None


@pytest.mark.parametrize("cubic", [-1e12, 1e12])
def test_a_spring_whose_stiffness_is_lost_is_physical(cubic, simulated):
    # A softening spring loses its stiffness within the motion, a snap-through spring has none at rest.
    linear = 1e6 if cubic < 0.0 else -1e5
    campaign = simulated(rig.Plant(BASE), rig.SteppedSine((100.0,), (3.0, 4.0, 5.0)))
    model = ij.Isolator(800.0, (ij.LinearStiffness(linear), ij.CubicStiffness(cubic), ij.LinearDamping(1e4)))
    assert find_violation(model, campaign.fit_records, "acceleration") is None


@pytest.mark.parametrize(("coefficient", "physical"), [(4e9, True), (-4e9, False), (-1e8, True)])
def test_damping_must_take_energy_away_from_the_middle_too(coefficient, physical, simulated):
    # c1 + c x^2 is negative beyond x = sqrt(-c1 / c): 1.6 mm and 10 mm, were 3 mm visited.
    plan = rig.SteppedSine((100.0,), (3.0, 4.0, 5.0))
    campaign = simulated(rig.Plant(BASE), plan)
    model = ij.Isolator(
        800.0,
        (ij.LinearStiffness(1e6), ij.LinearDamping(1e4), ij.PositionDamping(coefficient)),
    )
    largest = visited_range(model, campaign.fit_records, "acceleration")[0]
    scaled = model.replace(position_damping__coefficient=coefficient * (3e-3 / largest) ** 2)
    violation = find_violation(scaled, campaign.fit_records, "acceleration")
    assert (violation is None) == physical
    assert physical or "feeds energy in" in violation
