"""The experiment that separates a finding from its look-alikes, found by simulation with the fitted model."""

from typing import NamedTuple, Protocol, runtime_checkable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..._parameters import element_names, find_parameter, own_parameters
from ...elements import CATALOGUE, AbstractElement, Scales
from ...models import Integrator, Isolator
from .._rules import Rules
from ..diagnosis import Experiment, Extension, Prospect, Separation, rank_prospects
from ..fitting import Estimate, Nuisances, Simulator, one_hot
from ..guess import scales as campaign_scales
from ..jacobian import Segment
from ._candidate_experiments import DWELLS, candidate_experiments, find_test_outline, repeated_campaign
from ._known_load import KnownLoad
from ._simulated_records import TrialRun, blank_records, missing_channels, trial_run

LOOSE = 100.0
"""Factor on the spread of the initial states of the segments of a planned test."""


class _Question(NamedTuple):
    """What the experiments are asked.

    Attributes:
        fitted: the estimate without the effect.
        probes: the effect, then its look-alikes, at zero strength.
        names: parameters with a column: the fitted coefficients, then the strengths of the probes.
        sizes: size of one unit of each.
        strength: of the effect [its size].
    """

    fitted: Estimate
    probes: tuple[AbstractElement, ...]
    names: tuple[str, ...]
    sizes: tuple[float, ...]
    strength: float


@runtime_checkable
class Extended(Protocol):
    """Whatever holds extensions: a closed loop."""

    @property
    def extensions(self) -> tuple[Extension, ...]:
        """Each effect that was added, in the order of discovery."""
        ...


def find_separating_experiment(
    extension: Extension | Extended, *, seconds: float | None = None, rules: Rules = Rules()
) -> Separation:
    """Find the test that separates a finding from its look-alikes.

    Each candidate is simulated with the fitted model without the effect. With the effect A and a look-alike B
    riding along at zero strength, I the information on their strengths in the old records and the new ones
    together, all that the fitted coefficients, initial states and stiffness scales would absorb projected
    out, A explains them better than B by `s^2 (I_AA - I_AB^2 / I_BB)`, s the strength found; that is the
    expected chi2, per max(chi2/dof, 1) of the fit. Shapes of A and B stay as they were refitted.

    Args:
        extension: a model before and after the finding, such as one of `close_loop(campaign).extensions`; of
            a closed loop the last.
        seconds: measuring time of the new test [s]; that of the campaign if omitted.
        rules: the evidence that separates two effects.

    Returns:
        The candidates, best first. Without look-alikes, or where nothing drove the isolator on and on, there
        are none.

    Raises:
        ValueError: if the extension holds no finding, or `seconds` is not positive.

    Source: expected information for discrimination, Hunter & Reiner 1965, Technometrics 7:307.

    Example:
        With the extension of `extend`'s example, where no look-alike is left to separate:

        >>> ij.find_separating_experiment(better).others
        ()
    """
    extension = _last_extension(extension)
    finding = extension.verdict.finding
    if finding is None:
        raise ValueError("Argument `extension` must hold a finding, but its verdict names no effect.")
    if seconds is not None and not 0.0 < seconds < np.inf:
        raise ValueError(f"Argument `seconds` must be positive and finite, but is {seconds}.")
    campaign = extension.before.campaign
    problem = extension.before.estimate.problem
    lasted = sum(part.stop - part.counted for part in problem.segments) / campaign.rate
    seconds = lasted if seconds is None else seconds
    after = extension.fit.estimate
    # From here on a diagnosis of the old records and the new ones separates them.
    needed = max(rules.close_bic, rules.smallest_gain * after.dof * (1.0 + seconds / lasted))
    nothing = Separation(finding.effect, finding.indistinguishable, (), needed, seconds)
    if not finding.indistinguishable:
        return nothing
    question = _question(extension, campaign_scales(campaign))
    # The filter that whitens coloured noise is one of the campaign's samples.
    fine = (
        extension.before.model.substeps > 1
        or any(probe.channels for probe in question.probes)
        or bool(problem.whitening)
    )
    steps = problem.integrator.record_steps(extension.before.model)
    outline = find_test_outline(campaign, steps, every_sample=fine)
    if outline is None:
        return nothing
    model = question.fitted.model
    carrying = Isolator(model.mass, (*model.elements, KnownLoad(0.0)), model.excitation)
    first = _made(carrying, repeated_campaign(campaign, outline), question, 0.0)
    if not isinstance(first, TrialRun):
        return nothing
    rest = float(np.sqrt(2.0) * np.max(np.std(first.displacement, axis=1)))
    resting = (jnp.asarray(rest), *(jnp.zeros(()),) * (1 + model.internal_states))
    load = float(model.restoring_force(resting))
    # One noise for every sensor: as large beside the reading as the campaign's own.
    share = float(np.std(first.displacement) / np.std([record.output for record in first.records]))
    old = _information(
        question, question.fitted.simulator, model, question.probes, question.fitted.point.nuisances
    )
    prospects = []
    for experiment in candidate_experiments(campaign, outline, load):
        made = _made(carrying, experiment, question, rest)
        if not isinstance(made, TrialRun):
            prospects.append(Prospect(experiment, (), made))
            continue
        noise = problem.noise * (share if experiment.quantity != problem.quantity else 1.0)
        new = _of_trial(question, carrying, experiment, made, noise)
        total = old + seconds / experiment.seconds * new
        inflation = max(1.0, after.chi2 / after.dof)
        prospects.append(
            Prospect(experiment, _gains(question, total, inflation))
            if np.all(np.isfinite(new))
            else Prospect(experiment, (), "the motion diverges")
        )
    return nothing._replace(prospects=rank_prospects(tuple(prospects), needed))


def _last_extension(given: Extension | Extended) -> Extension:
    """Give the extension that is meant: of a loop the last."""
    last = (None, *given.extensions)[-1] if isinstance(given, Extended) else given
    if not isinstance(last, Extension):
        raise ValueError(
            "Argument `extension` must be an extension, such as `extend` gives it, or a loop that added an "
            f"effect, but is of type {type(given).__name__}."
        )
    return last


def with_separating_experiment(extension: Extension, rules: Rules = Rules()) -> Extension:
    """Put the test that separates a finding from its look-alikes into the finding.

    Args:
        extension: a model before and after the finding.
        rules: the evidence that separates two effects.

    Returns:
        The same extension; where nothing can be simulated, its finding keeps the advice in words.
    """
    finding = extension.verdict.finding
    if finding is None or not finding.indistinguishable:
        return extension
    separation = find_separating_experiment(extension, rules=rules)
    best, words = separation.best, separation.words
    if best is None:
        return extension
    if best.separated(separation.needed) == 0:
        words = f"{words} {finding.separating_experiment}"
    finding = finding._replace(separating_experiment=words, separation=separation)
    return extension._replace(verdict=extension.verdict._replace(finding=finding))


def _absent(element: AbstractElement) -> AbstractElement:
    """Give an element with its shape at zero strength."""
    return eqx.tree_at(lambda e: getattr(e, e.strength), element, jnp.zeros(()))


def _question(extension: Extension, scales: Scales) -> _Question:
    """Collect the columns that count: the fitted coefficients, the effect, its look-alikes."""
    finding, fitted = extension.verdict.finding, extension.before.estimate
    assert finding is not None
    effect = extension.fit.model.element(finding.effect)
    assert effect is not None
    known = {rival.name: rival for rival in finding.rivals}
    others = (known.get(name, CATALOGUE[name].guess(scales)) for name in finding.indistinguishable)
    probes = tuple(map(_absent, (effect, *others)))
    strength = float(getattr(effect, effect.strength))
    unit = dict(own_parameters(effect))[effect.strength].unit
    for held in fitted.model.elements:
        if held.name in effect.absorbs and dict(own_parameters(held))[held.strength].unit == unit:
            # What the model had of the law before is no part of the effect.
            strength -= float(getattr(held, held.strength))
    whole = Isolator(fitted.model.mass, (*fitted.model.elements, *probes), fitted.model.excitation)
    labels = element_names(whole)[len(fitted.model.elements) :]
    names = (
        *fitted.names,
        *(f"{label}.{probe.strength}" for label, probe in zip(labels, probes, strict=True)),
    )
    diagonal = np.diag(fitted.point.reduced.matrix)[:-1]
    sizes = [
        *np.sqrt(1.0 / np.maximum(diagonal, 1e-300)),
        *(1e-3 * probe.typical_strength(scales) for probe in probes),
    ]
    return _Question(fitted, probes, names, tuple(map(float, sizes)), strength / sizes[len(fitted.names)])


def _information(
    question: _Question,
    simulator: Simulator,
    model: Isolator,
    probes: tuple[AbstractElement, ...],
    nuisances: Nuisances,
) -> Float[np.ndarray, "column column"]:
    """Give the information on all columns; zero for those that these records do not have."""
    carried = len(model.elements)
    whole = Isolator(model.mass, (*model.elements, *probes), model.excitation)
    labels = {entry.name for entry in whole.parameters}
    present = [column for column, name in enumerate(question.names) if name in labels]
    places = [find_parameter(whole, question.names[column]) for column in present]
    directions = one_hot(whole, places, [question.sizes[column] for column in present])
    point = simulator.evaluate(whole, directions, nuisances, carried)
    matrix = np.zeros((len(question.names),) * 2)
    matrix[np.ix_(present, present)] = point.reduced.matrix[:-1, :-1]
    return matrix


def _made(model: Isolator, experiment: Experiment, question: _Question, rest: float) -> TrialRun | str:
    """Carry out an experiment; say why where that is impossible."""
    if experiment.lacking:
        return experiment.lacking
    problem = question.fitted.problem
    model = _as_tested(model, experiment)
    if experiment.load:
        restless = [e.words for e in (*model.elements, *question.probes) if not _rests(e, rest)]
        if restless:
            return f"the internal state of {' and '.join(restless)} would first have to settle under the load"
    blank = blank_records(experiment)
    lost = missing_channels(model, blank)
    if lost:
        return f"its records would have no {' or '.join(lost)} to follow"
    made = trial_run(model, experiment, blank, problem, rest if experiment.load else 0.0)
    return made if made.is_finite else "the motion diverges"


def _as_tested(model: Isolator, experiment: Experiment) -> Isolator:
    """Give the isolator with what the experiment puts on it."""
    load = KnownLoad(experiment.load)
    return Isolator(model.mass + experiment.extra_mass, (*model.elements[:-1], load), model.excitation)


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


def _of_trial(
    question: _Question, model: Isolator, experiment: Experiment, made: TrialRun, noise: float
) -> Float[np.ndarray, "column column"]:
    """Give the information that an experiment adds."""
    old, probes, starts = question.fitted.problem, question.probes, made.starts
    model = _as_tested(model, experiment)
    if experiment.quantity != old.quantity:
        rows = [0, 1]
        place = 2
        for element in model.elements:
            if _stays(element):
                rows += range(place, place + element.internal_states)
            place += element.internal_states
        kept = tuple(filter(_stays, model.elements))
        model, starts = Isolator(model.mass, kept, model.excitation), starts[rows]
        probes = tuple(filter(_stays, probes))
    if missing_channels(Isolator(model.mass, (*model.elements, *probes), model.excitation), made.records):
        return np.full((len(question.names),) * 2, np.nan)
    length = experiment.drive.shape[1] // DWELLS
    segments = tuple(
        Segment(row, piece * length, (piece + 1) * length, piece * length)
        for row in range(len(made.records))
        for piece in range(DWELLS)
    )
    # The step of `trial_run`, which made the records: another solver's error would pass for information.
    integrator = Integrator(substeps=old.integrator.substeps)
    simulator = Simulator(
        old._replace(
            records=made.records,
            segments=segments,
            quantity=experiment.quantity,
            noise=noise,
            integrator=integrator,
            heads=(),
        )
    )
    carried = len(model.elements)
    prepared = simulator.prepared(Isolator(model.mass, (*model.elements, *probes), model.excitation), carried)
    # Nothing may follow from a prior: an offset is no less likely than the motion is large.
    np.multiply(prepared.spread, LOOSE, out=prepared.spread)
    assumed, units = simulator.starts(model, prepared)
    nuisances = simulator.settle(None, model, carried, question.fitted.point.nuisances.spread)
    states = nuisances.states.copy()
    # The records show neither a mean nor an internal state: the states are those of the simulation.
    states[: starts.shape[1]] = ((starts - assumed[:, : starts.shape[1]]) / units[:, : starts.shape[1]]).T
    return _information(question, simulator, model, probes, nuisances._replace(states=states))


def _gains(
    question: _Question, information: Float[np.ndarray, "column column"], inflation: float
) -> tuple[float, ...]:
    """Give the expected chi2 of the effect over each look-alike."""
    count = len(question.fitted.names)
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information / np.outer(size, size)
    base, cross = scaled[:count, :count], scaled[:count, count:]
    left = scaled[count:, count:] - cross.T @ np.linalg.pinv(base, rcond=1e-12, hermitian=True) @ cross
    visible = (question.strength * size[count]) ** 2 / inflation
    gains = []
    for other in range(1, left.shape[0]):
        shared = left[0, other] ** 2 / max(left[other, other], 1e-300)
        gains.append(float(visible * max(0.0, left[0, 0] - shared)))
    return tuple(gains)
