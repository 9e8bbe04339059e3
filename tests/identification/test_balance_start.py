"""Laws with memory take part in the balance of measured forces: their states follow the measured motion."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from isojax.elements import CATALOGUE
from isojax.identification.guess import balance_starts, classical_guess, find_balance_start, scales
from isojax.records import Campaign, Dwell, InputChannel, OutputChannel, Record

RATE, FINER = 500.0, 16
MASS, STIFFNESS, DAMPING, SLIP, PRESLIDING = 2.0, 5e3, 8.0, 30.0, 1.5e-3
DRIVE, OUTPUT = InputChannel("force", "F", "N"), OutputChannel("acceleration", "a", "m/s^2")
LAWS = ("dahl_friction", "coulomb_friction", "cubic_stiffness", "abs_quadratic_damping", "maxwell_branch")
PROBES = tuple(CATALOGUE[name] for name in LAWS)


def dahl(x):
    """Dahl's law along a path in its closed form: between reversals the rest to +-1 decays with the way."""
    z = np.zeros_like(x)
    for place, way in enumerate(np.diff(x)):
        side = np.sign(way)
        z[place + 1] = side + (z[place] - side) * np.exp(-abs(way) / PRESLIDING)
    return z


def measured(motion, time):
    """Force and acceleration of a motion (of time and order) with Dahl's friction beside a spring."""
    fine = np.arange(time.size * FINER) / (RATE * FINER) + time[0]
    x, v, a = (motion(fine, order)[::FINER] for order in range(3))
    return MASS * a + STIFFNESS * x + DAMPING * v + SLIP * dahl(motion(fine, 0))[::FINER], a


def multisine(time, order):
    rng, total = np.random.default_rng(3), np.zeros_like(time)
    for frequency in np.arange(2.0, 12.0, 0.25):
        turn = 2 * np.pi * frequency
        total += 6e-4 * turn**order * np.sin(turn * time + rng.uniform(0, 2 * np.pi) + order * np.pi / 2)
    return total


def record(name, force, output, **fields):
    time = np.arange(force.size) / RATE
    return Record(name, Path(f"{name}.npz"), time, RATE, force, output, force, output, **fields)


def random_record():
    return record("random", *measured(multisine, np.arange(20000) / RATE), kind="broadband")


def stepped_record():
    parts, dwells = [], []
    for place, frequency in enumerate((5.0, 6.25, 10.0, 12.5)):
        turn = 2 * np.pi * frequency

        def sine(time, order, turn=turn):
            return 4e-3 * turn**order * np.sin(turn * time + order * np.pi / 2)

        before = round(10 * RATE / frequency)  # until the loop closes
        time = np.arange(-before, 2000) / RATE
        parts.append(np.stack(measured(sine, time))[:, before:])
        dwells.append(Dwell(place * 2000, (place + 1) * 2000, frequency, 4.0 * frequency))
    force, output = np.concatenate(parts, axis=1)
    return record("steps", force, output, dwells=tuple(dwells), kind="stepped_sine", level=1.0)


@pytest.fixture(params=[random_record, stepped_record])
def campaign(request):
    return Campaign(
        title="exact",
        file=Path("exact/campaign.toml"),
        mass=MASS,
        mass_free=False,
        input=DRIVE,
        output=OUTPUT,
        filter=None,
        rate=RATE,
        stiffness=("linear",),
        damping=("linear",),
        elements=(),
        records=(dataclasses.replace(request.param(), role="fit"),),
    )


def test_hysteresis_is_found_by_the_forces_alone(campaign):
    own = scales(campaign)
    shapes = tuple(shape for kind in PROBES for shape in kind.grid(own))
    first, *others = balance_starts(campaign, classical_guess(campaign).model, shapes)
    assert first.element.name == "dahl_friction"
    assert first.unexplained < 0.3 * min(one.unexplained for one in others)
    chosen = find_balance_start(campaign, classical_guess(campaign).model, own, shapes)
    # Where the motion is integrated no law that may forget what drifts is taken for a start.
    assert chosen is not None
    assert (chosen.element.name == "dahl_friction") == bool(campaign.records[0].dwells)


def test_with_its_own_shape_it_gives_the_coefficients(campaign):
    model = classical_guess(campaign).model
    element = CATALOGUE["dahl_friction"](0.0, PRESLIDING)
    (start,) = balance_starts(campaign, model, (element,))
    assert float(start.element.force_level) == pytest.approx(SLIP, rel=0.01)
    assert float(start.model["linear_stiffness.coefficient"]) == pytest.approx(STIFFNESS, rel=0.01)
    assert start.unexplained < 0.01
