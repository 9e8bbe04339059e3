"""A fit finds again what the simulated bench was built of; the bench shares no code with the models."""

from pathlib import Path
from typing import NamedTuple

import pytest
from solved_by_scipy import MASS, solved

from isojax import rig
from isojax._parameters import own_parameters
from isojax._quantities import CONDITIONS
from isojax._results import is_successful
from isojax.elements import CATALOGUE, CoulombFriction, LinearDamping, LinearStiffness
from isojax.identification import fit, scales
from isojax.identification.guess._force_balance import with_strength
from isojax.models import Integrator, Isolator

PLAN = rig.Multisine((60.0, 110.0), 2.0, 14.0, period=2.0, periods=5, lines="full")
EXACT = rig.Bench(rate=500.0, noise=2e-3, drift=0.0, force_noise=0.0, anti_alias=False, tolerance=1e-7)


class Case(NamedTuple):
    """An effect of the bench, its element at a start off the truth, its true coefficients."""

    effect: object
    start: tuple[float, ...]
    truth: tuple[float, ...]


CASES = {
    "linear_stiffness": Case(None, (1.0e6,), (1.08e6,)),
    "linear_damping": Case(None, (8e3,), (1e4,)),
    "abs_quadratic_stiffness": Case(rig.AbsQuadraticStiffness(2e8), (0.0,), (2e8,)),
    "cubic_stiffness": Case(rig.CubicStiffness(2.5e11), (1e11,), (2.5e11,)),
    "quadratic_stiffness": Case(rig.QuadraticStiffness(8e7), (0.0,), (8e7,)),
    "abs_quadratic_damping": Case(rig.AbsQuadraticDamping(8e4), (0.0,), (8e4,)),
    "cubic_damping": Case(rig.CubicDamping(2e6), (0.0,), (2e6,)),
    "position_damping": Case(rig.PositionDamping(1e10), (0.0,), (1e10,)),
    "coulomb_friction": Case(rig.CoulombFriction(6.0), (2.0, 2e-4), (6.0, 2e-4)),
    "dahl_friction": Case(rig.DahlFriction(6.0, 3e4), (3.0, 4e-4), (6.0, 2e-4)),
    "bouc_wen": Case(rig.BoucWen(2e5, 800.0, -500.0), (1.5e5, 1e3, -3e2, 1.0), (2e5, 800.0, -500.0, 1.0)),
    "maxwell_branch": Case(rig.MaxwellBranch(1.5e5, 0.03), (1e5, 0.02), (1.5e5, 0.03)),
    "added_mass": Case(rig.AddedMass(15.0), (0.0,), (15.0,)),
    "input_delay": Case(rig.InputDelay(4e-4), (0.0,), (4e-4,)),
    "input_gain": Case(rig.InputGain(0.03), (0.0,), (0.03,)),
    "input_offset": Case(rig.InputOffset(5.0), (0.0,), (5.0,)),
    "sensor_gain": Case(rig.SensorGain(-0.04), (0.0,), (-0.04,)),
    "sensor_offset": Case(rig.SensorOffset(0.02), (0.0,), (0.02,)),
    # Beside symmetrical friction, which it may not exceed: alone it would drive the motion one way.
    "asymmetric_friction": Case(rig.AsymmetricFriction(2.0), (0.5, 2e-4), (2.0, 2e-4)),
    # A gas column so short that its laws of compression and expansion part; the free spring stands beside it.
    "polytropic_gas": Case(
        rig.PolytropicGas(600.0, 1.5e-3, 1.3), (400.0, 2e-3, 1.3, 1.0), (600.0, 1.5e-3, 1.3, 1.0)
    ),
}
BESIDE = {"asymmetric_friction": (rig.CoulombFriction(6.0), CoulombFriction(5.0, 2e-4))}
"""What stands in the plant beside an effect, and in the model that is fitted."""
STATIC = ("asymmetric_friction", "input_offset")
"""Effects that shift the place of rest, which on a linear spring no accelerometer sees."""


ELSEWHERE = {
    "test_catalogue_laws.py": (
        "end_stop",
        "freeplay",
        "quintic_stiffness",
        "stribeck_friction",
    ),
    "test_catalogue_memory.py": (
        "ac_coupling",
        "clipping",
        "dual_chamber",
        "fractional_damping",
        "lugre_friction",
        "second_mode",
    ),
    "test_clock_skew.py": ("clock_skew",),
    "test_channels.py": ("damping_drift", "drive_harmonics", "input_hold", "mains_hum", "stiffness_drift"),
    "test_moving_floor.py": ("floor_motion",),
    "test_pressure.py": ("pressure_damping", "pressure_stiffness"),
}
"""Effects whose recovery has a file of its own."""


def test_recoveries_of_their_own_are_of_effects_of_the_catalogue():
    elsewhere = [name for names in ELSEWHERE.values() for name in names]
    own = [*CASES, *elsewhere]
    assert len(set(own)) == len(own)
    assert set(own) <= set(CATALOGUE)
    for file, names in ELSEWHERE.items():
        text = (Path(__file__).parent / file).read_text(encoding="utf-8")
        for name in names:
            assert name in text or CATALOGUE[name].__name__ in text


CONDITIONED = {name for name, kind in CATALOGUE.items() if set(CONDITIONS).intersection(kind.channels)}
"""Effects of a condition that these records do not state; `test_conditions.py` compares their forces."""

UNASKED = sorted(
    set(CATALOGUE) - set(CASES) - {name for names in ELSEWHERE.values() for name in names} - CONDITIONED
)
"""Effects without a recovery of their own, which a new one is at first: SciPy integrates their law."""


@pytest.mark.parametrize("name", ["cubic_damping", "maxwell_branch", *UNASKED])
def test_an_effect_is_recovered_from_what_scipy_makes_of_its_law(name):
    kind, base = CATALOGUE[name], (LinearStiffness(1.08e6), LinearDamping(1e4))
    magnitudes = scales(solved(base, levels=(80.0,)))
    truth = with_strength(kind.guess(magnitudes), 0.1 * kind.typical_strength(magnitudes))
    start = with_strength(truth, 0.5 * float(getattr(truth, kind.strength)))
    # What an exact look-alike needs free is held: beside it nothing could tell this effect's own strength.
    held = [name for alike in kind.look_alikes if alike.exact for name in alike.beside]
    fixed = tuple(f"{name}.{CATALOGUE[name].strength}" for name in held)
    found = fit(Isolator(MASS, (*base, start)), solved((*base, truth)), fixed=fixed, integrator=Integrator())
    assert is_successful(found.result)
    free = [field for field, spec in own_parameters(kind) if spec.fitted]
    for field in free:
        value, error = found.model[f"{name}.{field}"], found.standard_errors[f"{name}.{field}"]
        assert abs(float(value - getattr(truth, field))) < 4.0 * error
    assert found.standard_errors[f"{name}.{kind.strength}"] < 0.2 * abs(float(getattr(truth, kind.strength)))


LONG = ("bouc_wen", "dahl_friction")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in LONG else []) for name in CASES]
)
def test_every_effect_is_recovered_from_the_bench(name, simulated):
    case = CASES[name]
    plant = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4)))
    plant = plant if case.effect is None else plant.plus(case.effect)
    base = [LinearStiffness(1.05e6), LinearDamping(1.1e4)]
    if name in BESIDE:
        law, element = BESIDE[name]
        plant, base = plant.plus(law), [*base, element]
    bench = (
        EXACT
        if name not in STATIC
        else rig.Bench(
            rate=500.0,
            output="displacement",
            noise=1e-6,
            drift=0.0,
            force_noise=0.0,
            anti_alias=False,
            tolerance=1e-7,
        )
    )
    campaign = simulated(plant, PLAN, 3, bench)
    start = CATALOGUE[name](*case.start)
    elements = (*(one for one in base if one.name != name), start)
    found = fit(Isolator(800.0, elements), campaign, integrator=Integrator())
    assert is_successful(found.result)
    values = [float(found.model[f"{name}.{field}"]) for field in vars(start)]
    for field, value, truth in zip(vars(start), values, case.truth, strict=True):
        error = found.standard_errors.get(f"{name}.{field}")
        if error is not None:
            assert abs(value - truth) < 4.0 * error
            assert error < 0.2 * abs(truth)
