"""What a planned test says of coefficients and of absent effects, beside the records that were fitted."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..._parameters import element_names, find_parameter, own_parameters
from ...elements import AbstractElement
from ...models import Integrator, Isolator
from ..diagnosis import Experiment
from ..fitting import Estimate, Nuisances, Point, Simulator, build_problem, one_hot
from ._known_load import KnownLoad
from ._simulated_records import TrialRun, blank_records, missing_channels, trial_run

LOOSE = 100.0
"""Factor on the spread of the initial states of the segments of a planned test."""


DIVERGES = "the motion diverges"


class Columns(NamedTuple):
    """Parameters of which records are asked how much they say.

    Attributes:
        fitted: the estimate from the old records.
        probes: absent effects, at zero strength.
        names: parameters with a column: the fitted coefficients, then the strengths of the probes.
        sizes: size of one unit of each [its unit].
    """

    fitted: Estimate
    probes: tuple[AbstractElement, ...]
    names: tuple[str, ...]
    sizes: tuple[float, ...]


def absent(element: AbstractElement) -> AbstractElement:
    """Give an element with its shape at zero strength."""
    return eqx.tree_at(lambda e: getattr(e, e.strength), element, jnp.zeros(()))


def trial_columns(
    fitted: Estimate, probes: tuple[AbstractElement, ...], typical: tuple[float, ...]
) -> Columns:
    """Give the columns of the fitted coefficients and of the strengths of absent effects.

    Args:
        fitted: the estimate.
        probes: absent effects, at zero strength.
        typical: strength of each that would matter [its unit].

    Returns:
        The columns; a coefficient's unit is the standard error that it would have by itself.
    """
    whole = Isolator(fitted.model.mass, (*fitted.model.elements, *probes), fitted.model.excitation)
    labels = element_names(whole)[len(fitted.model.elements) :]
    strengths = (f"{label}.{probe.strength}" for label, probe in zip(labels, probes, strict=True))
    diagonal = np.diag(fitted.point.reduced.matrix)[:-1]
    alone = np.sqrt(1.0 / np.maximum(diagonal, 1e-300)).tolist()
    return Columns(fitted, probes, (*fitted.names, *strengths), (*alone, *(1e-3 * size for size in typical)))


def old_point(columns: Columns) -> Point:
    """Give the equations of the records that were fitted."""
    fitted = columns.fitted
    return _point(columns, fitted.simulator, fitted.model, columns.probes, fitted.point.nuisances)


def full_matrix(columns: Columns, point: Point) -> Float[np.ndarray, "column column"]:
    """Give the information on all columns; zero for those that these records do not have.

    Args:
        columns: all.
        point: equations of those that the records have.

    Returns:
        The information [inverse product of the columns' units].
    """
    labels = {entry.name for entry in point.model.parameters}
    present = [column for column, name in enumerate(columns.names) if name in labels]
    matrix = np.zeros((len(columns.names),) * 2)
    matrix[np.ix_(present, present)] = point.reduced.matrix[:-1, :-1]
    return matrix


def _point(
    columns: Columns,
    simulator: Simulator,
    model: Isolator,
    probes: tuple[AbstractElement, ...],
    nuisances: Nuisances,
) -> Point:
    whole = Isolator(model.mass, (*model.elements, *probes), model.excitation)
    labels = {entry.name for entry in whole.parameters}
    present = [column for column, name in enumerate(columns.names) if name in labels]
    places = [find_parameter(whole, columns.names[column]) for column in present]
    directions = one_hot(whole, places, [columns.sizes[column] for column in present])
    return simulator.evaluate(whole, directions, nuisances, len(model.elements))


def carry_out(
    columns: Columns, experiment: Experiment, rest: float, clock: tuple[float, float] | None = None
) -> TrialRun | str:
    """Carry out an experiment on the fitted model; say why where that is impossible.

    Args:
        columns: with the fitted model.
        experiment: the test; the motion of some of its records may diverge.
        rest: rest position under the load of the experiment [m].
        clock: start and end of every record as shares of the campaign; one after the other through all of it
            if omitted.

    Returns:
        The records, or the reason.
    """
    if experiment.lacking:
        return experiment.lacking
    problem = columns.fitted.problem
    model = as_tested(columns.fitted.model, experiment)
    if experiment.load:
        restless = [e.words for e in (*model.elements, *columns.probes) if not _rests(e, rest)]
        if restless:
            return f"the internal state of {' and '.join(restless)} would first have to settle under the load"
    blank = blank_records(experiment, clock)
    lost = missing_channels(model, blank)
    if lost:
        return f"its records would have no {' or '.join(lost)} to follow"
    return trial_run(model, experiment, blank, problem, rest if experiment.load else 0.0)


def as_tested(model: Isolator, experiment: Experiment) -> Isolator:
    """Give the isolator with what an experiment puts on it."""
    load = KnownLoad(experiment.load)
    return Isolator(model.mass + experiment.extra_mass, (*model.elements, load), model.excitation)


def _rests(element: AbstractElement, position: float) -> bool:
    """Say whether internal states at rest stay at rest away from the unloaded rest position."""
    empty = (jnp.zeros(()),) * element.internal_states
    rates = element.state_rate(jnp.asarray(position), jnp.zeros(()), empty)
    return not any(float(rate) != 0.0 for rate in rates)


def _stays(element: AbstractElement) -> bool:
    """Say whether an effect is there with another sensor: a share of the reading is, not what has a unit."""
    hooks = ("reading", "reading_rate", "channel_reading")
    if all(getattr(type(element), hook) is getattr(AbstractElement, hook) for hook in hooks):
        return True
    return all(spec.unit == "1" for _, spec in own_parameters(element))


def trial_point(
    columns: Columns, experiment: Experiment, made: TrialRun, rate: float, relative: float
) -> Point | None:
    """Give the equations of the records of an experiment.

    The noise has the density of the campaign's, the median of its records: records of fewer samples a second
    have less of it a sample.
    Segments are cut as a fit would cut them.

    Args:
        columns: what is asked.
        experiment: the test.
        made: its records, all of them finite.
        rate: samples a second of the campaign [Hz].
        relative: noise of the sensor over that of the campaign's; of another sensor, in its own unit.

    Returns:
        The equations, a record each; None where the records have not what an effect follows.
    """
    old, probes = columns.fitted.problem, columns.probes
    model = as_tested(columns.fitted.model, experiment)
    rows = list(range(len(made.path)))
    if experiment.quantity != old.quantity:
        rows, place = [0, 1], 2
        for element in model.elements:
            if _stays(element):
                rows += range(place, place + element.internal_states)
            place += element.internal_states
        model = Isolator(model.mass, tuple(filter(_stays, model.elements)), model.excitation)
        probes = tuple(filter(_stays, probes))
    if missing_channels(Isolator(model.mass, (*model.elements, *probes), model.excitation), made.records):
        return None
    noise = float(np.median(old.noise)) * relative * float(np.sqrt(experiment.rate / rate))
    problem = build_problem(
        made.records,
        model,
        quantity=experiment.quantity,
        hold=old.hold,
        noise=(noise,) * len(made.records),
        # The step of `trial_run`, which made the records: another solver's error would pass for information.
        integrator=Integrator(substeps=old.integrator.substeps, band_limited=old.integrator.band_limited),
        share=old.share,
        whitening=old.whitening,
    )
    simulator = Simulator(problem)
    carried = len(model.elements)
    prepared = simulator.prepared(Isolator(model.mass, (*model.elements, *probes), model.excitation), carried)
    # Nothing may follow from a prior: an offset is no less likely than the motion is large.
    np.multiply(prepared.spread, LOOSE, out=prepared.spread)
    assumed, units = simulator.starts(model, prepared)
    nuisances = simulator.settle(None, model, carried, columns.fitted.point.nuisances.spread)
    states = nuisances.states.copy()
    # The records show neither a mean nor an internal state: the states are those of the simulation.
    owner, first = np.array([(one.record, one.start) for one in problem.segments]).T
    starts = made.path[rows][:, owner, first]
    states[: owner.size] = ((starts - assumed[:, : owner.size]) / units[:, : owner.size]).T
    return _point(columns, simulator, model, probes, nuisances._replace(states=states))


def needs_every_sample(columns: Columns) -> bool:
    """Say whether a simulation must have the campaign's own sampling rate."""
    fitted = columns.fitted
    # The filter that whitens coloured noise is one of the campaign's samples.
    return (
        fitted.model.substeps > 1
        or any(probe.channels for probe in columns.probes)
        or bool(fitted.problem.whitening)
    )


def expected_chi2(
    information: Float[np.ndarray, "column column"],
    known: tuple[int, ...],
    effect: int,
    other: int,
    strength: float,
) -> float:
    """Give the chi2 by which an effect explains records better than another that stands in its place.

    `s^2 (I_AA - I_AB^2 / I_BB)`, all that the other coefficients would absorb projected out.

    Args:
        information: on all columns.
        known: columns of the coefficients that both laws share.
        effect: column of the strength of the effect.
        other: column of that of the other.
        strength: of the effect [unit of its column].

    Returns:
        The expected chi2; NaN where the simulation of a law diverged.

    Source: Hunter & Reiner 1965, Technometrics 7:307.
    """
    if not np.all(np.isfinite(information)):
        return float("nan")
    pair = [effect, other]
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information / np.outer(size, size)
    base, cross = scaled[np.ix_(known, known)], scaled[np.ix_(known, pair)]
    left = scaled[np.ix_(pair, pair)] - cross.T @ np.linalg.pinv(base, rcond=1e-12, hermitian=True) @ cross
    shared = left[0, 1] ** 2 / max(left[1, 1], 1e-300)
    return float((strength * size[effect]) ** 2 * max(0.0, left[0, 0] - shared))
