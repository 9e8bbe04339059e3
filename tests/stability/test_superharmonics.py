"""Below resonance a motion has several maxima: each counts once, with its whole size, by SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isojax import Harmonic, Isolator, elements, find_periodic_orbit, stability_map

MASS, NATURAL = 800.0, 2.0 * np.pi * 5.0
"""Of a mount whose spring is twice as stiff at 5 mm, with two per cent of critical damping."""

STIFFNESS, DAMPING = MASS * NATURAL**2, 0.04 * MASS * NATURAL
CUBIC = STIFFNESS / 5e-3**2


def settled(force, frequency, law, mass, periods):
    """Give the state at t = 0 and half the range of the motion to which SciPy settles from rest."""
    omega = 2.0 * np.pi * frequency

    def rates(t, y):
        return [y[1], (force * np.sin(omega * t) - law(*y)) / mass]

    ends = [0.0, periods / frequency, (periods + 1.0) / frequency]
    options = dict(method="DOP853", rtol=1e-11, atol=1e-14)
    before = solve_ivp(rates, ends[:2], [0.0, 0.0], **options).y[:, -1]
    period = solve_ivp(rates, ends[1:], before, dense_output=True, **options)
    path = period.sol(np.linspace(*ends[1:], 20_001))[0]
    return before, 0.5 * (path.max() - path.min())


def test_a_motion_of_several_maxima_counts_once_with_its_whole_size():
    laws = (
        elements.LinearStiffness(STIFFNESS),
        elements.CubicStiffness(CUBIC),
        elements.LinearDamping(DAMPING),
    )
    forces, band = np.linspace(100.0, 4000.0, 14), np.linspace(1.0, 2.6, 9)
    smap = stability_map(Isolator(MASS, laws), forces, band, coexisting=True)
    count, starts = np.asarray(smap.count), np.asarray(smap.y0)
    assert np.mean(count == 1) > 0.95
    for row, column in ((5, 4), (6, 5), (12, 2), (13, 5), (9, 3)):
        state, size = settled(
            forces[row], band[column], lambda x, v: STIFFNESS * x + CUBIC * x**3 + DAMPING * v, MASS, 60.0
        )
        apart = np.abs(starts[:, row, column] - state).max(axis=1)
        place = int(np.nanargmin(apart))
        np.testing.assert_allclose(
            starts[place, row, column], state, rtol=0.0, atol=2e-4 * np.abs(state).max()
        )
        assert float(smap.response[place, row, column]) == pytest.approx(size, rel=2e-5)


def test_an_orbit_to_which_no_balance_leads_is_found_from_rest():
    def law(x, v):
        return x + 0.5 * x**2 + 0.3 * x**3 + 0.04 * v

    laws = elements.LinearStiffness(1.0), elements.QuadraticStiffness(0.5), elements.CubicStiffness(0.3)
    model = Isolator(1.0, (*laws, elements.LinearDamping(0.04)))
    force, frequency = 0.48344827586, 0.08461538461
    state, size = settled(force, frequency, law, 1.0, 120.0)
    orbit = find_periodic_orbit(model, Harmonic(force, frequency))
    np.testing.assert_allclose(orbit.y0, state, rtol=1e-6)
    assert float(orbit.amplitude) == pytest.approx(size, rel=1e-5)
    cell = stability_map(model, [force], [frequency])
    assert int(cell.count[0, 0]) == 1
    assert float(cell.response[0, 0]) == pytest.approx(size, rel=1e-5)
