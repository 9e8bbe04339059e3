"""A fit simulates by the diffrax solver that its integrator names, to its tolerances; SciPy is the judge."""

from pathlib import Path
from typing import NamedTuple

import diffrax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isojax import rig
from isojax._parameters import list_parameters, replace_parameters
from isojax._results import is_successful
from isojax.elements import (
    CATALOGUE,
    CoulombFriction,
    CubicStiffness,
    LinearDamping,
    LinearStiffness,
    MaxwellBranch,
)
from isojax.identification import diagnose, fit
from isojax.identification.fitting._problem import one_hot
from isojax.identification.jacobian import (
    STIFFNESS_SCALE_UNIT,
    Unknowns,
    information,
    prepare,
    readings,
    score_information,
)
from isojax.identification.jacobian._segments import Segment
from isojax.models import Integrator, Isolator, check_integrator
from isojax.records import Record

MASS, RATE, LENGTH = 800.0, 250.0, 120
MODEL = Isolator(
    MASS, (LinearStiffness(1.08e6), CubicStiffness(2.5e11), LinearDamping(1.0e4), MaxwellBranch(2e5, 0.04))
)
NUMBERS = (1.08e6, 2.5e11, 1.0e4, 2e5, 0.04)
LOOSE, TIGHT = Integrator(diffrax.Dopri8(), rtol=1e-3), Integrator(diffrax.Dopri8(), rtol=1e-10, atol=1e-14)
START = np.array([1e-4, -2e-3, 3e-5])
SCALES = np.array([1e-4, 3e-3, 5e-5])
FACTOR = 1.01


def _record(place: int) -> Record:
    rng, time = np.random.default_rng(place), np.arange(LENGTH) / RATE
    drive = 120.0 * np.sin(2 * np.pi * 5.3 * time + place) + 50.0 * np.sin(2 * np.pi * 8.1 * time)
    output = 0.2 * rng.standard_normal(LENGTH)
    return Record(f"r{place}", Path("r.npz"), time, RATE, drive, output, drive, output)


RECORDS = (_record(0), _record(1))


def _law(numbers, factor: float, state, force: float):
    """Rates of a Duffing oscillator with a Maxwell branch, written out."""
    k, k3, c, stiffness, tau = numbers
    x, v, s = state
    return v, (force - factor * k * x - k3 * x**3 - c * v - stiffness * s) / MASS, v - s / tau


def _by_scipy(record: Record, hold: str, numbers=NUMBERS, factor: float = FACTOR, start=START) -> np.ndarray:
    """Acceleration at the samples, solved from each sample to the next, where the drive is smooth."""
    drive, state, found = record.input, np.asarray(start, dtype=float), []
    for place in range(LENGTH):
        found.append(_law(numbers, factor, state, drive[place])[1])
        slope = 0.0 if hold == "zero_order" or place + 1 == LENGTH else drive[place + 1] - drive[place]

        def rates(t, y, first=drive[place], slope=slope):
            return _law(numbers, factor, y, first + slope * t * RATE)

        state = solve_ivp(rates, (0.0, 1.0 / RATE), state, "DOP853", rtol=1e-12, atol=1e-16).y[:, -1]
    return np.array(found)


def _setting(integrator: Integrator, model: Isolator = MODEL, hold: str = "linear"):
    """Both records, a lane each, and every coefficient a direction."""
    segments = tuple(Segment(place, 0, LENGTH, 0) for place in range(2))
    prepared = prepare(
        RECORDS,
        segments,
        quantity="acceleration",
        hold=hold,
        substeps=integrator.table_steps(model),
        integrator=integrator,
    )
    values = [float(entry.value) for entry in list_parameters(model)]
    places = [place for place, entry in enumerate(list_parameters(model)) if entry.spec.fitted]
    directions = one_hot(model, places, [0.1 * values[place] for place in places])
    states = 2 + model.internal_states
    lanes = prepared.record.size
    start, scales = (np.repeat(one[:states, None], lanes, axis=1) for one in (START, SCALES))
    return prepared, Unknowns(model, directions, np.full(lanes, FACTOR), start, scales)


def _simulated(integrator: Integrator, model: Isolator = MODEL, hold: str = "linear") -> np.ndarray:
    prepared, unknowns = _setting(integrator, model, hold)
    return readings(unknowns.model, *unknowns[2:4], prepared)[:LENGTH, :2]


@pytest.mark.parametrize("hold", ["linear", "zero_order"])
def test_a_record_is_what_scipy_solves_to_the_tolerance_asked_for(hold):
    wanted = np.stack([_by_scipy(record, hold) for record in RECORDS], axis=1)
    size = np.std(wanted)
    loose, tight = (np.max(np.abs(_simulated(one, hold=hold) - wanted)) / size for one in (LOOSE, TIGHT))
    assert tight < 1e-8
    # A drive that jumps at every sample takes a step a sample, which is already finer than is asked for.
    assert loose < 3e-2
    assert hold == "zero_order" or loose > 1e-6


@pytest.mark.parametrize("hold", ["linear", "zero_order"])
def test_fixed_steps_of_another_solver_converge_at_its_order(hold):
    wanted = np.stack([_by_scipy(record, hold) for record in RECORDS], axis=1)
    steps = (4, 8)
    errors = [
        np.max(np.abs(_simulated(Integrator(diffrax.Heun(), substeps=count), hold=hold) - wanted))
        for count in steps
    ]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


def test_columns_are_the_differences_of_what_scipy_solves():
    prepared, unknowns = _setting(TIGHT)
    found = information(unknowns, prepared)

    def reading(moved: np.ndarray) -> np.ndarray:
        numbers = np.array(NUMBERS) * (1.0 + 0.1 * moved[:5])
        factor, start = FACTOR + STIFFNESS_SCALE_UNIT * moved[5], START + SCALES * moved[6:]
        return np.concatenate([_by_scipy(record, "linear", numbers, factor, start) for record in RECORDS])

    step = 1e-3
    columns = [(reading(step * unit) - reading(-step * unit)) / (2.0 * step) for unit in np.eye(9)]
    left = np.concatenate([record.output for record in RECORDS]) - reading(np.zeros(9))
    dense = np.stack([*columns, left], axis=1)
    for lane in range(2):
        own = dense[lane * LENGTH : (lane + 1) * LENGTH]
        wanted = own.T @ own
        size = np.sqrt(np.diag(wanted))
        assert np.max(np.abs(found[lane] - wanted) / np.outer(size, size)) < 1e-6


def test_an_implicit_solver_gives_the_same_columns():
    implicit = Integrator(diffrax.Kvaerno5(), rtol=1e-9, atol=1e-12)
    found, wanted = (information(one[1], one[0])[0] for one in map(_setting, (implicit, TIGHT)))
    size = np.sqrt(np.diag(wanted))
    assert np.max(np.abs(found - wanted) / np.outer(size, size)) < 1e-5


def test_columns_are_the_differences_of_coarse_steps_themselves():
    integrator = Integrator(diffrax.Heun())
    prepared, unknowns = _setting(integrator)
    gram = information(unknowns, prepared)[0]
    values = [float(entry.value) for entry in list_parameters(MODEL)]
    for column, place in enumerate(np.flatnonzero(unknowns.directions.any(axis=1))):
        size, sides = unknowns.directions[place, column], []
        for sign in (1e-3, -1e-3):
            numbers = [value + sign * size * (at == place) for at, value in enumerate(values)]
            sides.append(_simulated(integrator, replace_parameters(MODEL, numbers))[:, 0])
        slope = (sides[0] - sides[1]) / 2e-3
        assert gram[column, column] == pytest.approx(np.sum(slope**2), rel=1e-5)


@pytest.mark.parametrize("friction", [False, True], ids=["smooth", "rounded friction"])
def test_columns_of_absent_effects_are_worked_out_along_the_same_motion(friction):
    base = Isolator(MASS, MODEL.elements[:3])
    base = base.with_elements(CoulombFriction(20.0, 2e-2)) if friction else base
    full = base.with_elements(MaxwellBranch(0.0, 0.04))
    names = [entry.name for entry in list_parameters(full)]
    carried = len(base.elements)
    prepared, known = _setting(TIGHT, base)
    places = [names.index("linear_damping.coefficient"), names.index("maxwell_branch.stiffness")]
    start, scales = np.zeros((3, 2)), np.ones((3, 2))
    start[:2], scales[:2] = known.states, known.state_scales
    unknowns = Unknowns(full, one_hot(full, places, [1e3, 1e3]), known.stiffness_scale, start, scales)
    wanted = information(unknowns, prepared)[0][np.ix_((0, 1, 2, 3, 4, 6), (0, 1, 2, 3, 4, 6))]
    found = score_information(unknowns, carried, prepared)[0]
    size = np.sqrt(np.diag(wanted))
    # The internal state of the absent effect has a say in the adaptive steps.
    assert found[-1, -1] == pytest.approx(wanted[-1, -1], rel=1e-7)
    assert np.max(np.abs(found - wanted) / np.outer(size, size)) < 2e-3


class Fitted(NamedTuple):
    campaign: object
    loose: object
    tight: object
    default: object


@pytest.fixture(scope="module")
def fitted(simulated):
    """A hardening isolator with an effect that the model lacks, fitted by three solvers."""
    plant = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4), rig.QuadraticStiffness(2e8)))
    plan = rig.Multisine((80.0,), 2.0, 14.0, period=2.0, periods=2, lines="full")
    campaign = simulated(plant, plan, 4)
    start = Isolator(MASS, (LinearStiffness(1.0e6), LinearDamping(1.3e4)))
    chosen = (LOOSE, TIGHT, Integrator(substeps=16))
    return Fitted(campaign, *(fit(start, campaign, integrator=one) for one in chosen))


def test_chi2_feels_the_tolerance_and_converges_to_that_of_many_fixed_steps(fitted):
    loose, tight, default = (one.stats.chi2 for one in fitted[1:])
    assert abs(tight / default - 1.0) < 1e-5
    assert abs(loose / default - 1.0) > 1e-4
    assert all(is_successful(one.result) for one in fitted[1:])


def test_reports_name_what_integrated_the_records(fitted):
    assert "integration          = Dopri8 of diffrax, rtol 1e-10, atol 1e-14" in str(fitted.tight)
    assert "integration          = RK4, 16 a sample" in str(fitted.default)


@pytest.mark.slow
def test_a_diagnosis_beside_such_a_fit_finds_what_the_default_finds(fitted):
    rivals = {
        "quadratic_stiffness",
        "maxwell_branch",
    }  # without and with a state; this solver compiles slowly
    others = tuple(sorted(set(CATALOGUE) - rivals))
    found, wanted = (diagnose(one, excluded=others).finding for one in (fitted.tight, fitted.default))
    assert found.effect == wanted.effect
    assert found.ranking[0].z == pytest.approx(wanted.ranking[0].z, rel=1e-3)


def test_a_simulation_that_diverges_is_said_to_and_ends(fitted):
    start = Isolator(MASS, (LinearStiffness(1.0e6), LinearDamping(1.3e4), CubicStiffness(-1e15)))
    found = fit(start, fitted.campaign, fixed=("cubic_stiffness.coefficient",), integrator=LOOSE)
    assert not is_successful(found.result)


@pytest.mark.parametrize(
    ("integrator", "words"),
    [
        (Integrator(diffrax.SemiImplicitEuler()), "holds SemiImplicitEuler: Terms are not compatible"),
        (Integrator(diffrax.KenCarp4(), rtol=1e-6), "holds KenCarp4: Terms are not compatible"),
        (Integrator(diffrax.Kvaerno5()), "holds Kvaerno5: A fixed step size controller"),
    ],
    ids=["symplectic", "split", "implicit without tolerances"],
)
def test_an_integrator_that_cannot_simulate_records_is_refused(fitted, integrator, words):
    start = Isolator(MASS, (LinearStiffness(1.0e6), LinearDamping(1.3e4)))
    with pytest.raises(ValueError, match=f"Argument `integrator` .*{words}"):
        fit(start, fitted.campaign, integrator=integrator)


def test_a_solver_is_no_integrator():
    with pytest.raises(
        ValueError, match=r"Argument `integrator` must be an Integrator, .* but is Dopri8\(\)"
    ):
        check_integrator(diffrax.Dopri8())
