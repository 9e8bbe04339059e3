"""Laws with memory and the response channel of the simulated plant, against solutions on paper and SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from isojax import rig

MASS, STIFFNESS, DAMPING = 800.0, 1.08e6, 1.0e4
LINEAR = rig.Plant((rig.LinearStiffness(STIFFNESS), rig.LinearDamping(DAMPING)), MASS)
FORCE = 50.0


def rms(values):
    return np.sqrt(np.mean(values**2))


def settled(plant, w, times):
    """Displacement under a sine of 50 N from rest."""
    return rig.response(plant, [rig.Tones(0.0, times[-1] + 1, 0.0, (FORCE,), (w,), (0.0,))], times)[
        "displacement"
    ]


def sine(dynamic, w, times):
    """Displacement under the same sine by a dynamic stiffness, N/m."""
    return (FORCE / dynamic * np.exp(1j * w * times)).imag


@pytest.mark.parametrize("order", [0.3, 0.7])
@pytest.mark.parametrize("frequency", [2.0, 5.5])
def test_fractional_damping_has_the_stiffness_of_the_fractional_derivative(order, frequency):
    w, times = 2 * np.pi * frequency, np.arange(5, 6, 2e-3)
    coefficient = 4e5 / 30.0**order
    x = settled(LINEAR.plus(rig.FractionalDamping(coefficient, order)), w, times)
    dynamic = STIFFNESS - MASS * w**2 + 1j * w * DAMPING + coefficient * (1j * w) ** order
    assert rms(x - sine(dynamic, w, times)) < 3e-3 * rms(x)


@pytest.mark.parametrize("frequency", [4.0, 6.1, 9.0])
def test_second_mode_has_the_receptance_of_two_masses(frequency):
    w, times = 2 * np.pi * frequency, np.arange(12, 13, 2e-3)
    m2, f2, ratio = 60.0, 6.0, 0.05
    x = settled(LINEAR.plus(rig.SecondMode(m2, f2, ratio)), w, times)
    w2 = 2 * np.pi * f2
    link = m2 * (w2**2 + 2j * ratio * w2 * w)
    carried = link * (-m2 * w**2) / (link - m2 * w**2)
    dynamic = STIFFNESS - MASS * w**2 + 1j * w * DAMPING + carried
    assert rms(x - sine(dynamic, w, times)) < 1e-6 * rms(x)


CHAMBERS = rig.DualChamber(0.02, 2e-3, 5e-3, 1.1e7)


def test_dual_chamber_with_a_laminar_line_is_stiff_by_the_volume_ratio_and_slow_by_the_resistance():
    w, times = 2 * np.pi * 4.7, np.arange(8, 9, 2e-3)
    x = settled(LINEAR.plus(CHAMBERS), w, times)
    branch = CHAMBERS.low_stiffness * 5e-3 / 2e-3
    tau = 1.1e7 * 2e-3 * 5e-3 / (1.4 * 5e5 * 7e-3)
    dynamic = STIFFNESS - MASS * w**2 + 1j * w * (DAMPING + branch * tau / (1 + 1j * w * tau))
    np.testing.assert_allclose(CHAMBERS.low_stiffness, 1.4 * 5e5 * 0.02**2 / 7e-3)
    assert rms(x - sine(dynamic, w, times)) < 1e-6 * rms(x)


def test_dual_chamber_with_an_orifice_is_the_gas_of_two_chambers():
    w, times = 2 * np.pi * 4.7, np.arange(0, 1, 4e-3)
    resistance, orifice, force = 2e6, 2e10, 400.0
    plant = LINEAR.plus(rig.DualChamber(0.02, 2e-3, 5e-3, resistance, orifice))
    motion = rig.response(plant, [rig.Tones(0.0, 2.0, 0.0, (force,), (w,), (0.0,))], times)

    def flow(difference):
        reach = abs(difference) / resistance + 1e-12
        return brentq(
            lambda q: resistance * q + orifice * abs(q) * q - difference,
            -reach,
            reach,
            xtol=1e-18,
            rtol=1e-14,
        )

    def rates(t, y):
        x, v, first, second = y
        passing = flow(first - second)
        gas = 0.02 * first - CHAMBERS.low_stiffness * x
        pushed = force * np.sin(w * t) - STIFFNESS * x - DAMPING * v - gas
        squeezed = 0.02 * v - passing
        return [v, pushed / MASS, 7e5 / 2e-3 * squeezed, 7e5 / 5e-3 * passing]

    scale = np.array([1e-9, 1e-8, 1e-3, 1e-3]) * 1e-2
    expected = solve_ivp(rates, (0, 1), [0.0] * 4, "DOP853", times, rtol=1e-10, atol=scale, max_step=2e-3)
    assert rms(motion["displacement"] - expected.y[0]) < 1e-6 * rms(expected.y[0])


def test_lugre_friction_is_the_published_law():
    w, times = 2 * np.pi * 4.7, np.arange(0, 1, 4e-3)
    law = rig.LugreFriction(12.0, 19.0, 4e-3, 12.0 / 4e-5, 400.0)
    motion = rig.response(LINEAR.plus(law), [rig.Tones(0.0, 2.0, 0.0, (FORCE,), (w,), (0.0,))], times)

    def rates(t, y):
        x, v, z = y
        bend = v - 3e5 * abs(v) * z / (12.0 + 7.0 * np.exp(-((v / 4e-3) ** 2)))
        friction = 3e5 * z + 400.0 * bend
        return [v, (FORCE * np.sin(w * t) - STIFFNESS * x - DAMPING * v - friction) / MASS, bend]

    expected = solve_ivp(rates, (0, 1), [0.0] * 3, "DOP853", times, rtol=1e-10, atol=1e-14, max_step=5e-4)
    assert rms(motion["displacement"] - expected.y[0]) < 1e-6 * rms(expected.y[0])


def test_lugre_friction_slides_at_its_stribeck_force():
    law = rig.LugreFriction(12.0, 19.0, 4e-3, 3e5, 400.0)
    speed = 5e-3
    sliding = 12.0 + 7.0 * np.exp(-((speed / 4e-3) ** 2))
    assert law.rate(0.0, 0.0, speed, [sliding / 3e5], [1.0])[0] == pytest.approx(0.0, abs=1e-17)
    assert law.force(0.0, 0.0, speed, [sliding / 3e5], [1.0]) == pytest.approx(sliding)


def test_ac_coupling_is_an_rc_high_pass_from_a_discharged_capacitor():
    corner, w = 0.3, 2 * np.pi * 4.7
    times = np.arange(0.0, 4.0, 4e-3)
    wc = 2 * np.pi * corner
    y = np.sin(w * times + 0.4) + 0.2
    # c' = wc (y - c), c(0) = 0
    follow = wc / (wc + 1j * w) * np.exp(0.4j)
    voltage = (follow * np.exp(1j * w * times)).imag + 0.2 - (follow.imag + 0.2) * np.exp(-wc * times)
    np.testing.assert_allclose(rig.AcCoupling(corner).recorded_output(times, y), y - voltage, atol=3e-6)


def test_clipping_keeps_what_is_within_the_level():
    y = np.array([-3.0, -1.0, 0.0, 1.9, 2.1])
    found = rig.Clipping(2.0).recorded_output(np.arange(5.0), y)
    np.testing.assert_array_equal(found, [-2.0, -1.0, 0.0, 1.9, 2.0])
