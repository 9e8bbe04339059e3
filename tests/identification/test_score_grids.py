"""An absent effect rides along at a few shapes: whatever its true shape, one of them must look like it."""

import numpy as np
import pytest
from strange_laws import BASE

import isojax as ij
from isojax import rig
from isojax.elements import EndStop, Freeplay, SecondMode
from isojax.identification import scales
from isojax.identification.traces import project

SHAPES = 12
"""Shapes drawn of each kind."""


@pytest.fixture(scope="module")
def fitted(simulated):
    plan = rig.SteppedSine((60.0, 140.0), (4.0, 4.5, 5.0, 5.6, 6.2), cycles=12)
    return ij.fit(simulated(rig.Plant(BASE), plan))


def _freeplay(random, motion):
    return Freeplay._placed(motion, random.uniform(0.1, 0.6))


def _stop(random, motion):
    return EndStop._placed(motion, random.uniform(0.4, 0.9), random.choice([-0.9, 0.0, 0.9]))


def _mode(random, motion):
    natural = motion.angular_frequency * np.exp(random.uniform(np.log(0.8), np.log(2.5)))
    return SecondMode(0.0, natural, np.exp(random.uniform(np.log(0.02), np.log(0.1))))


@pytest.mark.slow
@pytest.mark.parametrize("draw", [_freeplay, _stop, _mode])
def test_no_shape_falls_between_those_of_the_grid(draw, fitted):
    motion, random = scales(fitted.campaign), np.random.default_rng(3)
    true = [draw(random, motion) for _ in range(SHAPES)]
    grid = type(true[0]).grid(motion)
    probes = (*grid, *true)
    units = np.array([1e-3 * probe.typical_strength(motion) for probe in probes])
    information = project(fitted.estimate, probes, units).information
    size = np.sqrt(np.diag(information))
    likeness = (information / np.outer(size, size))[len(grid) :, : len(grid)].max(axis=1)
    assert likeness.min() > 0.7
    assert np.median(likeness) > 0.9
