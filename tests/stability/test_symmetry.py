"""Laws that act on one side only, and far from rest, against SciPy."""

import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import isojax as ij
from isojax._parameters import parameter
from isojax._types import Internal, Lanes, Scalar
from isojax.elements import Group
from isojax.stability.orbit import is_odd

FORCE, FREQUENCY = 0.6, 0.2
PLACE, WIDTH, PUSH = 0.289, 0.026, 0.3


class Bump(ij.AbstractElement):
    """A push around one place, within which no displacement is tried beforehand."""

    name: ClassVar[str] = "bump"
    words: ClassVar[str] = "push at one place"
    strength: ClassVar[str] = "push"
    group: ClassVar[Group] = "Springs"

    push: Scalar = parameter(symbol="p", unit="N")

    @classmethod
    def guess(cls, scales: ij.elements.Scales) -> "Bump":
        return cls(0.0 * scales.force)

    @classmethod
    def typical_strength(cls, scales: ij.elements.Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.push * jnp.maximum(1.0 - ((x - PLACE) / WIDTH) ** 2, 0.0) ** 6


def with_bump() -> ij.Isolator:
    laws = ij.elements.LinearStiffness(1.0), ij.elements.LinearDamping(0.2), Bump(PUSH)
    return ij.Isolator(1.0, laws)


def period_later(state: np.ndarray) -> np.ndarray:
    """The state one drive period later, by DOP853."""
    omega = 2.0 * math.pi * FREQUENCY

    def rates(t, y):
        push = PUSH * max(1.0 - ((y[0] - PLACE) / WIDTH) ** 2, 0.0) ** 6
        return [y[1], FORCE * math.sin(omega * t) - y[0] - 0.2 * y[1] - push]

    ends = 0.0, 1.0 / FREQUENCY
    return solve_ivp(rates, ends, state, method="DOP853", rtol=1e-11, atol=1e-13, max_step=2e-3).y[:, -1]


@pytest.mark.parametrize(("gap", "width"), [(0.5, 1e-6), (0.5, 1e-3), (0.03, 1e-5), (80.0, 1e-3)])
def test_a_stop_on_one_side_is_not_odd_however_far_it_is(gap, width):
    base = ij.Isolator(1.0, (ij.elements.LinearStiffness(1.0), ij.elements.LinearDamping(0.2)))
    assert is_odd(base)
    assert not is_odd(base.with_elements(ij.elements.EndStop(5.0, gap, 1.0, width)))


def test_an_orbit_that_meets_a_law_on_one_side_is_closed_over_the_whole_period():
    model, drive = with_bump(), ij.Harmonic(FORCE, FREQUENCY)
    assert is_odd(model)
    orbit = ij.find_periodic_orbit(model, drive)
    assert ij.is_successful(orbit.result)
    assert not bool(orbit.symmetric)
    state = np.asarray(orbit.y0)
    np.testing.assert_allclose(period_later(state), state, atol=1e-7)
    with pytest.raises(ValueError, match="`symmetric` must be False for a model that is not odd"):
        ij.find_periodic_orbit(model, drive, symmetric=True)


def test_a_branch_that_meets_a_law_on_one_side_is_closed_over_the_whole_period():
    settings = {"parameter": "amplitude", "frequency": FREQUENCY, "start": 0.05, "stop": FORCE}
    branch = ij.continue_branch(with_bump(), **settings, other_periods=())
    assert not branch.symmetric
    state = np.asarray(branch.points.y0[-1])
    # The steps of a branch are coarse for a push that lasts a hundredth of the period.
    np.testing.assert_allclose(period_later(state), state, atol=2e-3)


def test_a_map_that_meets_a_law_on_one_side_is_one_of_whole_periods(monkeypatch):
    class Asked(Exception):
        """Ends the map where its orbits would be sought."""

    def stop(model, integrator, half, *more):
        raise Asked(half)

    monkeypatch.setattr("isojax.stability.map._map.seek", stop)
    for forces, half in (([1e-3, 2e-3], True), ([0.3, FORCE], False)):
        with pytest.raises(Asked) as asked:
            ij.stability_map(with_bump(), forces, [FREQUENCY, 0.25])
        # Up to three times the motion that these forces need: below the place of the push, and past it.
        assert asked.value.args == (half,)
