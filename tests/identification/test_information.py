"""The information that segments hold is that of a dense Jacobian of an independent simulation."""

import itertools
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
import pytest

from isojax import rig
from isojax._parameters import list_parameters, parameter, replace_parameters
from isojax._types import Scalar
from isojax.elements import (
    AbstractElement,
    AddedMass,
    BoucWen,
    ClockSkew,
    CoulombFriction,
    CubicDamping,
    CubicStiffness,
    DahlFriction,
    EndStop,
    InputDelay,
    InputGain,
    InputOffset,
    LinearDamping,
    LinearStiffness,
    MaxwellBranch,
    PositionDamping,
    QuadraticStiffness,
    SensorGain,
    SensorOffset,
)
from isojax.excitations import Sampled
from isojax.identification.fitting._problem import one_hot
from isojax.identification.jacobian import _batch, _score_columns
from isojax.identification.jacobian._batch import Prepared, prepare
from isojax.identification.jacobian._information import information, readings
from isojax.identification.jacobian._score_columns import score_information
from isojax.identification.jacobian._segments import Segment
from isojax.identification.jacobian._unknowns import STIFFNESS_SCALE_UNIT, Unknowns
from isojax.models import Integrator, Isolator, simulate
from isojax.records import Record
from isojax.rig._motion_equation import EquationOfMotion
from isojax.rig._solver import PlantIntegrator

RATE = 500.0
SPRING = (LinearStiffness(1.08e6), CubicStiffness(2.5e11), LinearDamping(1.0e4))


def _records(lengths, amplitude=120.0):
    """Two tones that fade in and out, and a reading that belongs to no model: residuals must not vanish."""
    rng = np.random.default_rng(5)
    records = []
    for place, length in enumerate(lengths):
        time = np.arange(length) / RATE
        fade = np.sin(0.5 * np.pi * np.clip(10.0 * np.minimum(time, time[-1] - time), 0.0, 1.0)) ** 6
        tones = np.sin(2 * np.pi * 5.3 * time + place) + 0.4 * np.sin(2 * np.pi * 8.1 * time)
        drive = amplitude * fade * tones
        output = 0.2 * rng.standard_normal(length)
        records.append(Record(f"r{place}", Path("r.npz"), time, RATE, drive, output, drive, output))
    return tuple(records)


class Case(NamedTuple):
    model: Isolator
    quantity: str = "acceleration"
    hold: str = "band_limited"
    amplitude: float = 120.0
    segments: tuple[Segment, ...] = (Segment(0, 0, 300, 40), Segment(1, 0, 220, 0))


CASES = {
    "friction": Case(Isolator(800.0, (*SPRING, CoulombFriction(8.0, 2e-3))), hold="linear"),
    "sticking": Case(Isolator(800.0, (*SPRING, CoulombFriction(60.0, 2e-3))), hold="linear"),
    "maxwell": Case(Isolator(800.0, (*SPRING, MaxwellBranch(2e5, 0.04))), hold="linear"),
    "hysteresis": Case(Isolator(800.0, (*SPRING, BoucWen(1e5, 800.0, -300.0, 1.0), DahlFriction(5.0, 2e-4)))),
    "delay": Case(Isolator(800.0, (*SPRING, InputDelay(7e-4)))),
    "skew": Case(Isolator(800.0, (*SPRING, InputDelay(-4e-4), ClockSkew(5e3)))),
    "straight skew": Case(Isolator(800.0, (*SPRING, ClockSkew(-5.3e3))), hold="linear"),
    "instruments": Case(
        Isolator(800.0, (*SPRING, InputGain(0.1), InputOffset(9.0), SensorGain(-0.05), SensorOffset(0.02))),
        quantity="displacement",
    ),
    "base excitation": Case(
        Isolator(800.0, (*SPRING, AddedMass(20.0), SensorGain(0.03)), "base_acceleration"), amplitude=0.15
    ),
    "no spring": Case(Isolator(800.0, (LinearDamping(1.0e4),)), quantity="velocity", hold="zero_order"),
}


def _setting(case: Case, substeps: int | None = None) -> tuple[Prepared, Unknowns, tuple[int, ...]]:
    records = _records((300, 220), case.amplitude)
    model = case.model
    prepared = prepare(
        records,
        case.segments,
        quantity=case.quantity,
        hold=case.hold,
        substeps=Integrator().record_steps(model) if substeps is None else substeps,
        shift=float(model.shift()),
        skew=float(model.skew()),
        based=model.excitation == "base_acceleration",
        channels=("elapsed",),
    )
    listed = list_parameters(model)
    places = tuple(place for place, entry in enumerate(listed) if entry.spec.fitted or entry.name == "mass")
    sizes = [0.1 * abs(float(listed[place].value)) for place in places]
    lanes, states = prepared.record.size, 2 + model.internal_states
    inner = [
        0.1 if element.name == "dahl_friction" else 5e-5
        for element in model.elements
        if element.internal_states
    ]
    scales = np.ones((states, lanes)) * np.array([1e-4, 3e-3, *inner])[:, None]
    start = 0.7 * scales
    factor = np.linspace(1.01, 0.99, lanes)
    return prepared, Unknowns(model, one_hot(model, places, sizes), factor, start, scales), places


def _exact(model: Isolator, drive: np.ndarray, start: list[float]) -> np.ndarray:
    """Acceleration under a drive that is straight between samples, from the event-exact bench.

    Its jumps are those of band-limited steps, as far as the nearest sample on each side.
    """
    times = np.arange(drive.size) / RATE
    slopes = np.diff(drive, append=0.0) * RATE
    pieces = [rig.Line(t, t + 1.0 / RATE, t, f, s) for t, f, s in zip(times, drive, slopes, strict=True)]
    laws = (rig.LinearStiffness, rig.CubicStiffness, rig.LinearDamping, rig.CoulombFriction)
    strengths = [getattr(element, element.strength) for element in model.elements]
    plant = rig.Plant(tuple(law(float(f)) for law, f in zip(laws, strengths, strict=True)), float(model.mass))
    balance = EquationOfMotion(plant)
    path = PlantIntegrator(balance, 1e-11).run(pieces, [float(s) for s in start])
    states, sides, held = path.at(times)
    found = np.asarray(balance.acceleration(times, states, drive, sides, held))
    for before, (at, _, state, _, *after) in itertools.pairwise(path._steps):
        place = min(int(at * RATE), drive.size - 1)
        share, push = at * RATE - place, np.array([pieces[place].force(at)])
        sooner, later = (
            float(balance.acceleration(at, np.array(state)[:, None], push, np.array(own)[:, None], stuck)[0])
            for own, stuck in (before[4:], after)
        )
        jump = later - sooner
        found[place] += jump * (1.0 - share) * (0.5 - 0.8 * share)
        if place + 1 < drive.size:
            found[place + 1] -= jump * share * (0.5 - 0.8 * (1.0 - share))
    return found


def _columns(case: Case, unknowns: Unknowns, lane: int, length: int) -> np.ndarray:
    """Dense central differences of `models.simulate`, one column an unknown, the residual last."""
    record = _records((300, 220), case.amplitude)[lane]
    model = unknowns.model
    listed = list_parameters(model)
    stiffness = (
        [entry.name for entry in listed].index("linear_stiffness.coefficient")
        if (model.element("linear_stiffness") is not None)
        else None
    )
    columns = unknowns.directions.shape[1]

    def reading(steps):
        numbers = [entry.value for entry in listed]
        moved = unknowns.directions @ steps[:columns]
        numbers = [number + moved[place] for place, number in enumerate(numbers)]
        if stiffness is not None:
            factor = unknowns.stiffness_scale[lane] + STIFFNESS_SCALE_UNIT * steps[columns]
            numbers[stiffness] = numbers[stiffness] * factor
        inner = steps[columns + (stiffness is not None) :]
        start = [
            unknowns.states[index, lane] + unknowns.state_scales[index, lane] * inner[index]
            for index in range(unknowns.states.shape[0])
        ]
        if model.slides:
            return _exact(replace_parameters(model, numbers), record.input[:length], start)
        run = simulate(
            replace_parameters(model, numbers),
            Sampled(record.input, RATE, case.hold),
            duration=(length - 1) / RATE,
            rate=RATE,
            initial_state=start,
            quantity=case.quantity,
            integrator=Integrator(substeps=model.substeps),
        )
        return run.reading

    count = columns + (stiffness is not None) + unknowns.states.shape[0]
    step = 1e-4
    sides = [np.asarray(reading(sign * step * unit)) for unit in np.eye(count) for sign in (1.0, -1.0)]
    slopes = [(up - down) / (2.0 * step) for up, down in zip(sides[::2], sides[1::2], strict=True)]
    left = record.output[:length] - np.asarray(reading(np.zeros(count)))
    return np.stack([*slopes, left], axis=1)


def _deviation(found: np.ndarray, wanted: np.ndarray) -> float:
    size = np.sqrt(np.maximum(np.diag(wanted), 1e-20))
    return float(np.max(np.abs(found - wanted) / np.outer(size, size)))


@pytest.mark.parametrize("name", ["instruments", "delay"])
def test_batches_of_one_lane_give_what_wider_ones_give(monkeypatch, every_core, name):
    case = CASES[name]._replace(segments=4 * CASES[name].segments)
    alone, same, _ = _setting(case)
    assert len(alone.batches) == 2
    wanted = information(same, alone), readings(same.model, *same[2:4], alone)
    used = len(alone.segments)
    with monkeypatch.context() as narrow:
        narrow.setattr(_batch, "MOST_LANES", 1)
        shared, _, _ = _setting(case)
    assert len(shared.batches) == used
    fields = ("stiffness_scale", "states", "state_scales")
    own = same._replace(**{field: getattr(same, field)[..., :used] for field in fields})
    found = information(own, shared), readings(own.model, *own[2:4], shared)
    for lane, segment in enumerate(alone.segments):
        assert _deviation(found[0][lane], wanted[0][lane]) < 1e-12
        size = segment.stop - segment.start
        np.testing.assert_allclose(found[1][:size, lane], wanted[1][:size, lane], rtol=1e-12, atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_information_is_that_of_a_dense_jacobian(name):
    case = CASES[name]
    prepared, unknowns, _ = _setting(case)
    found = information(unknowns, prepared)
    for lane, (length, counted) in enumerate(((300, 40), (220, 0))):
        dense = _columns(case, unknowns, lane, length)[counted:]
        wanted = dense.T @ dense
        # The bench is exact between samples; where the mass sticks, its breaking loose is found to h^3.
        assert _deviation(found[lane], wanted) < {"friction": 6e-5, "sticking": 1e-3}.get(name, 3e-6)


@pytest.mark.parametrize("name", ["friction", "delay", "skew", "base excitation"])
def test_information_follows_central_differences(name):
    case = CASES[name]
    prepared, unknowns, places = _setting(case)
    gram = information(unknowns, prepared)[0]
    listed = list_parameters(unknowns.model)
    base = case.model
    for column, place in enumerate(places):
        size = unknowns.directions[place, column]
        sides = []
        for sign in (1.0, -1.0):
            numbers = [entry.value for entry in listed]
            numbers[place] = numbers[place] + sign * 1e-4 * size
            model = replace_parameters(base, numbers)
            again = prepare(
                _records((300, 220), case.amplitude),
                prepared.segments,
                quantity=case.quantity,
                hold=case.hold,
                substeps=Integrator().record_steps(base),
                shift=float(model.shift()),
                skew=float(model.skew()),
                channels=("elapsed",),
                based=model.excitation == "base_acceleration",
            )
            sides.append(readings(model, unknowns.stiffness_scale, unknowns.states, again)[40:300, 0])
        slope = (sides[0] - sides[1]) / 2e-4
        assert gram[column, column] == pytest.approx(np.sum(slope**2), rel=1e-5)


def test_samples_that_do_not_count_add_nothing():
    prepared, unknowns, _ = _setting(CASES["maxwell"])
    whole = information(unknowns, prepared)
    records = _records((300, 220))
    spoiled = (
        tuple(
            Record(
                r.name,
                r.file,
                r.time,
                r.rate,
                r.input,
                r.output + 1e3 * (np.arange(r.output.size) < 40),
                r.input,
                r.output,
            )
            for r in records[:1]
        )
        + records[1:]
    )
    again = prepare(spoiled, prepared.segments, quantity="acceleration", hold="linear", substeps=1)
    np.testing.assert_allclose(information(unknowns, again), whole, rtol=1e-10, atol=1e-6)


class RoundedFriction(AbstractElement):
    """Dry friction over its width, which is how the columns of an absent effect take it."""

    name: ClassVar[str] = CoulombFriction.name
    strength: ClassVar[str] = CoulombFriction.strength
    substeps: ClassVar[int] = CoulombFriction.substeps

    force_level: Scalar = parameter(symbol="Fc", unit="N", lower=0.0)
    width: Scalar = parameter(symbol="vs", unit="m/s", lower=0.0, fitted=False)

    guess = CoulombFriction.guess
    typical_strength = CoulombFriction.typical_strength
    force = CoulombFriction.force


PROBES = (
    QuadraticStiffness(0.0),
    CubicDamping(0.0),
    PositionDamping(0.0),
    RoundedFriction(0.0, 1e-2),
    MaxwellBranch(0.0, 0.03),
    MaxwellBranch(0.0, 0.1),
    BoucWen(0.0, 2e3, -1e3, 1.0),
    AddedMass(0.0),
    ClockSkew(0.0),
    InputDelay(0.0),
    InputGain(0.0),
    InputOffset(0.0),
    SensorGain(0.0),
    SensorOffset(0.0),
)


@pytest.mark.parametrize(
    "model",
    [
        Isolator(800.0, (*SPRING,)),
        Isolator(800.0, (*SPRING, MaxwellBranch(2e5, 0.04))),
        Isolator(800.0, (*SPRING, RoundedFriction(8.0, 2e-2))),
        Isolator(800.0, (*SPRING, CoulombFriction(40.0, 2e-3))),
        Isolator(800.0, (*SPRING, EndStop(4e5, 1e-4, 0.3, 1e-6))),
        Isolator(800.0, (LinearDamping(1e4), CubicStiffness(2e13)), "base_acceleration"),
    ],
    ids=["spring", "memory", "four steps a sample", "friction", "stop", "base excitation"],
)
def test_many_columns_at_once_are_those_of_the_exact_derivatives(model):
    exact, found = _both_ways(model)
    for lane in range(2):
        assert _deviation(found[lane], exact[lane]) < 3e-4


def test_columns_of_a_few_lanes_at_a_time_are_those_of_the_exact_derivatives(monkeypatch):
    for module in (_batch, _score_columns):
        monkeypatch.setattr(module, "workers", lambda: 1)
    # Room for three lanes: of eight, the last block holds one again.
    monkeypatch.setattr(_score_columns, "_ENTRIES", 2.6e5)
    segments = 3 * (Segment(0, 0, 300, 40), Segment(1, 0, 220, 0), Segment(0, 90, 300, 110))
    exact, found = _both_ways(Isolator(800.0, (*SPRING, MaxwellBranch(2e5, 0.04))), segments=segments)
    assert len(found) == 16
    for lane in range(len(segments)):
        assert _deviation(found[lane], exact[lane]) < 3e-4


def _both_ways(model, segments=CASES["maxwell"].segments):
    """Information with probes among the columns: by exact derivatives, and by one linear solve."""
    probes = tuple(probe for probe in PROBES if model.element(probe.name) is None)
    full = model.with_elements(*probes)
    amplitude = 120.0 if model.excitation == "force" else 0.15
    prepared, unknowns, _ = _setting(Case(model, amplitude=amplitude, segments=segments))
    names = [entry.name for entry in list_parameters(full)]
    wanted = [name for name in names if name.split(".")[-1] in ("coefficient", "stiffness", "force_level")]
    wanted += [name for name in names if name.split(".")[-1] in ("delay", "rate", "deviation", "offset")]
    places = [names.index(name) for name in wanted]
    sizes = [1e-3 * max(1.0, float(list_parameters(full)[place].value)) for place in places]
    lanes, own, states = prepared.record.size, 2 + model.internal_states, 2 + full.internal_states
    start = np.zeros((states, lanes))
    start[:own] = unknowns.states
    scales = np.ones((states, lanes))
    scales[:own] = unknowns.state_scales
    moved = Unknowns(full, one_hot(full, places, sizes), unknowns.stiffness_scale, start, scales)
    exact = information(moved, prepared)
    first = len(places) + (model.element("linear_stiffness") is not None)
    keep = np.r_[0 : first + own, first + states]
    found = score_information(moved, len(model.elements), prepared)
    return [one[np.ix_(keep, keep)] for one in exact], found
