"""Orbits under a sine with harmonics, compared with superposition, SciPy and central differences."""

import equinox as eqx
import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import isojax as ij
from isojax.elements import CubicStiffness, DriveHarmonics, InputDelay, LinearDamping, LinearStiffness
from isojax.models import FitAt
from isojax.stability.orbit import is_odd

MASS, STIFFNESS, DAMPING = 800.0, 1e6, 4e3
LINEAR = ij.Isolator(MASS, (LinearStiffness(STIFFNESS), LinearDamping(DAMPING)))
DUFFING = ij.Isolator(
    1.0, (LinearStiffness(1.0), LinearDamping(0.1), CubicStiffness(0.2), DriveHarmonics(0.25, 0.6, 3.0))
)
DRIVE = ij.Harmonic(0.3, 0.2)


@eqx.filter_jit
def orbit_of(model, drive, integrator):
    orbit = ij.find_periodic_orbit(model, drive, symmetric=False, integrator=integrator)
    return orbit.y0, orbit.floquet.multipliers, orbit.harmonics


def superposed(added, amplitude, frequency, delay, count):
    """Complex amplitudes of the displacement of the linear isolator, mean first."""
    rate, size = 2.0 * np.pi * frequency, abs(amplitude)
    theta = (-0.5 if amplitude > 0.0 else 0.5) * np.pi - rate * delay
    found = np.zeros(count, complex)
    for share, phase, order in [(1.0, 0.0, 1), *added]:
        angular = order * rate
        receptance = 1.0 / (STIFFNESS - MASS * angular**2 + 1j * DAMPING * angular)
        found[order] += receptance * share * size * np.exp(1j * (order * theta + phase))
    return found


@pytest.mark.parametrize("amplitude", [100.0, -100.0])
def test_harmonics_of_the_drive_superpose_in_a_linear_isolator(amplitude):
    # Two of one kind, an even one, and a delay that turns each as its order says.
    added = ((0.3, 0.7, 3), (0.2, -1.1, 2))
    model = LINEAR.with_elements(*(DriveHarmonics(*one) for one in added), InputDelay(4e-3))
    _, _, found = orbit_of(model, ij.Harmonic(amplitude, 4.0), ij.Integrator(steps_per_period=512))
    wanted = superposed(added, amplitude, 4.0, 4e-3, 8)
    np.testing.assert_allclose(found[:8], wanted, atol=1e-9 * abs(wanted[1]))
    balance = ij.harmonic_balance(model, ij.Harmonic(amplitude, 4.0))
    np.testing.assert_allclose(balance.coefficients[0], wanted, atol=1e-9 * abs(wanted[1]))


def test_harmonics_without_their_fundamental_are_refused_or_superpose_beside_next_to_none():
    model = LINEAR.with_elements(DriveHarmonics(1e11, 0.7, 3.0))
    _, _, found = orbit_of(model, ij.Harmonic(1e-9, 4.0), ij.Integrator(steps_per_period=1024))
    wanted = superposed(((1e11, 0.7, 3),), 1e-9, 4.0, 0.0, 8)
    np.testing.assert_allclose(found[:8], wanted, atol=1e-9 * abs(wanted[3]))
    none = ij.Harmonic(0.0, 4.0)
    ends = {"amplitude": 0.0, "start": 3.0, "stop": 5.0}
    for call in (
        lambda: ij.find_periodic_orbit(model, none),
        lambda: ij.harmonic_balance(model, none),
        lambda: ij.continue_branch(model, parameter="frequency", **ends),
    ):
        with pytest.raises(ValueError, match="an amplitude other than 0 where harmonics are added"):
            call()


def flow(start, share, amplitude=0.3, frequency=0.2):
    """State and monodromy of the Duffing oscillator after a drive period, by SciPy."""
    rate = 2.0 * np.pi * frequency

    def right(t, w):
        theta = rate * t - 0.5 * np.pi
        drive = amplitude * (np.cos(theta) + share * np.cos(3.0 * theta + 0.6))
        x, v = w[:2]
        slope = np.array([[0.0, 1.0], [-1.0 - 0.6 * x**2, -0.1]])
        return [v, drive - 0.1 * v - x - 0.2 * x**3, *(slope @ w[2:].reshape(2, 2)).ravel()]

    begin = np.concatenate([start, np.eye(2).ravel()])
    found = solve_ivp(right, (0.0, 2.0 * np.pi / rate), begin, method="DOP853", rtol=1e-11, atol=1e-12)
    return found.y[:2, -1], found.y[2:, -1].reshape(2, 2)


def test_an_orbit_its_multipliers_and_its_derivative_are_those_of_scipy():
    def start(share):
        model = DUFFING.replace(drive_harmonics__share=share)
        return ij.find_periodic_orbit(model, DRIVE).y0

    orbit = ij.find_periodic_orbit(DUFFING, DRIVE)
    assert orbit.symmetric
    state, matrix = flow(np.asarray(orbit.y0), 0.25)
    np.testing.assert_allclose(state, orbit.y0, atol=1e-9)
    found = np.sort_complex(np.asarray(orbit.floquet.multipliers))
    np.testing.assert_allclose(found, np.sort_complex(np.linalg.eigvals(matrix)), atol=1e-8)
    # Of the motion that closes: (1 - M) dz/dh = dphi/dh, with the end of the motion by central differences.
    ends = [flow(np.asarray(orbit.y0), 0.25 + sign * 1e-4)[0] for sign in (-1.0, 1.0)]
    wanted = np.linalg.solve(np.eye(2) - matrix, (ends[1] - ends[0]) / 2e-4)
    np.testing.assert_allclose(jax.jacfwd(start)(0.25), wanted, atol=1e-6)


def test_cells_of_a_map_hold_the_orbits_of_the_whole_drive():
    smap = ij.stability_map(DUFFING, [0.28, 0.3], [0.07, 0.2], coexisting=True)
    # In a band of three orbits; and where the harmonic alone makes the resonance.
    np.testing.assert_array_equal(smap.count[:, 1], [3, 3])
    starts, found = np.asarray(smap.y0), np.asarray(smap.multipliers)
    for orbit, row, column in np.argwhere(np.isfinite(starts[..., 0]))[::3]:
        start = starts[orbit, row, column]
        state, matrix = flow(start, 0.25, float(smap.amplitudes[row]), float(smap.frequencies[column]))
        np.testing.assert_allclose(state, start, atol=1e-4)
        sizes = np.abs(found[orbit, row, column]), np.abs(np.linalg.eigvals(matrix))
        np.testing.assert_allclose(*map(np.sort, sizes), atol=5e-5)


def test_a_base_that_moves_with_harmonics_passes_on_what_superposes():
    share, phase, order = 0.25, 0.6, 3
    elements = (*LINEAR.elements, DriveHarmonics(share, phase, order))
    found = ij.transmissibility(ij.Isolator(MASS, elements, "base_acceleration"), 0.1, [4.0])
    rate, theta = 2.0 * np.pi * 4.0, 2.0 * np.pi / 4096 * np.arange(4096)
    base, absolute = np.zeros(4096), np.zeros(4096)
    for size, lead, multiple in ((1.0, 0.0, 1), (share, phase, order)):
        passing = STIFFNESS + 1j * DAMPING * multiple * rate
        passed = passing / (passing - MASS * (multiple * rate) ** 2)
        wave = size / multiple**2 * np.exp(1j * (multiple * theta + lead))
        base, absolute = base + wave.real, absolute + (passed * wave).real
        if multiple == 1:
            np.testing.assert_allclose(found.ratio, [passed], rtol=1e-6)
    np.testing.assert_allclose(found.peak, [np.ptp(absolute) / np.ptp(base)], rtol=1e-5)


def test_the_response_of_the_fundamental_ignores_harmonics_of_a_linear_isolator():
    # From below the frequency at which the third harmonic makes the resonance, as large as the fundamental.
    model = LINEAR.with_elements(DriveHarmonics(1.0, 0.6, 3.0))
    names = ("linear_stiffness.coefficient",)
    fit = FitAt(model, names, np.array([[1e8]]), ij.RESULTS.successful)
    (curve,) = ij.response_bands(fit, [2.0], (1.5, 9.0)).curves
    rate = 2.0 * np.pi * curve.frequency
    size = 2.0 / np.abs(STIFFNESS + 1j * DAMPING * rate - MASS * rate**2)
    np.testing.assert_allclose(curve.displacement, size, rtol=2e-4)
    assert curve.stable.all()


def test_an_even_harmonic_breaks_the_symmetry_and_an_odd_one_does_not():
    assert is_odd(DUFFING)
    assert is_odd(LINEAR.with_elements(DriveHarmonics(0.1, 0.2, 5.0)))
    # Also without strength: its derivative breaks it.
    assert not is_odd(LINEAR.with_elements(DriveHarmonics(0.0, 0.2, 2.0)))
    with pytest.raises(ValueError, match="symmetric"):
        ij.find_periodic_orbit(DUFFING.replace(drive_harmonics__order=2.0), DRIVE, symmetric=True)


def test_a_simulation_of_a_sine_takes_the_same_drive():
    model = LINEAR.with_elements(DriveHarmonics(0.3, 0.7, 2.0), InputDelay(4e-3))
    waves = superposed([(0.3, 0.7, 2)], 100.0, 4.0, 4e-3, 3)
    rate = 2.0 * np.pi * 4.0 * np.arange(3)
    begin = (float(np.sum(waves).real), float(np.sum(1j * rate * waves).real))
    found = ij.simulate(model, ij.Harmonic(100.0, 4.0), duration=0.25, initial_state=begin)
    wanted = np.real(np.exp(1j * np.multiply.outer(np.asarray(found.time), rate)) @ waves)
    np.testing.assert_allclose(found.displacement, wanted, atol=1e-6 * abs(waves[1]))


def test_what_a_drive_cannot_have_is_refused():
    with pytest.raises(ValueError, match="order"):
        DriveHarmonics(0.1, 0.0, 2.5)
    with pytest.raises(ValueError, match="steps a drive period"):
        ij.find_periodic_orbit(
            DUFFING.replace(drive_harmonics__order=15.0), DRIVE, integrator=ij.Integrator()
        )
    with pytest.raises(ValueError, match="harmonics"):
        ij.harmonic_balance(DUFFING, DRIVE, harmonics=2)
    with pytest.raises(ValueError, match="count"):
        ij.continue_branch(
            DUFFING, parameter="drive_harmonics.order", amplitude=0.3, frequency=0.2, start=2.0, stop=3.0
        )
    DriveHarmonics(0.1, 0.0, 3.0).check_record()
    with pytest.raises(ValueError, match="2 or 3"):
        DriveHarmonics(0.1, 0.0, 5.0).check_record()
