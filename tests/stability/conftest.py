"""Orbits of the paper's models that several tests look at, each found once."""

import pytest

from isojax import Harmonic, paper
from isojax.stability import find_periodic_orbit, stability_map


@pytest.fixture(scope="session")
def y_orbit():
    """The y model at 150 N and 4.3 Hz: symmetric, by the half-period map."""
    return find_periodic_orbit(paper.y_direction(), Harmonic(150.0, 4.3))


@pytest.fixture(scope="session")
def y_orbit_full(y_orbit):
    """The same from its own state, by the full period."""
    return find_periodic_orbit(y_orbit.model, y_orbit.excitation, start=y_orbit.y0)


@pytest.fixture(scope="session")
def lens_map():
    """All orbits of the y model on both sides of its lens of folds."""
    return stability_map(
        paper.y_direction(),
        [120.0, 148.0, 150.0, 160.0, 175.0, 192.5, 210.0],
        [4.1, 4.2, 4.4, 4.8],
        coexisting=True,
    )
