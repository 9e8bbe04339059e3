"""The score test: absent effects ride along at zero strength; what a refit would absorb is projected out."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy import stats

from ...elements import CATALOGUE, AbstractElement, Scales
from ...models import Isolator
from ..fitting import (
    Estimate,
    Nuisances,
    ScatteredScores,
    Search,
    scores_over_scatters,
    step_nuisances,
)
from ..jacobian import effects_without_signal, line_coherence
from ..traces import Projection, project

NULL_DRAWS = 20_000
"""Draws for a family-wise p-value."""

FEWEST_EXCEEDANCES = 50
"""Draws beyond a score from which their share is a p-value to within a seventh."""


class Score(NamedTuple):
    """What the data say of one absent effect, before any refit.

    Attributes:
        element: the effect at zero strength, with the shape parameters of its largest score.
        z: score over its standard deviation; its sign is that of the strength.
        strength: strength by one linear step [its unit].
        error: standard error of the strength, over all scatters that the records allow [its unit].
        visibility: share of the column that the fitted coefficients and nuisances leave.
        p_value: family-wise, over all candidates.
        admissible: whether the sign of the strength is physical.
        column: place of the effect among the probes.
    """

    element: AbstractElement
    z: float
    strength: float
    error: float
    visibility: float
    p_value: float
    admissible: bool
    column: int


class ScoreTest(NamedTuple):
    """Scores of all absent effects.

    Attributes:
        scores: one a family, largest |z| first; effects below the visibility limit are left out.
        hidden: catalogue names that the data cannot show beside the fitted coefficients.
        likeness: correlation of the projected columns of `scores`, in their order.
        fitted: the estimate that was tested.
        steps: linear step of the fitted coefficients that goes with each score's strength [their units].
        nuisances: nuisances that go with that step.
    """

    scores: tuple[Score, ...]
    hidden: tuple[str, ...]
    likeness: Float[np.ndarray, "score score"]
    fitted: Estimate
    steps: tuple[Float[np.ndarray, " column"], ...]
    nuisances: tuple[Nuisances, ...]


def absent_effects(
    model: Isolator, scales: Scales, excluded: tuple[str, ...] = ()
) -> tuple[AbstractElement, ...]:
    """Give every catalogue effect that the model lacks, over the grids of their shape parameters."""
    held = {element.name for element in model.elements}
    present = held | set(excluded)
    present |= {name for element in model.elements for name in element.absorbs}
    return tuple(
        probe
        for name, kind in sorted(CATALOGUE.items())
        if name not in present and held.issuperset(kind.needs)
        for probe in kind.grid(scales)
    )


def score_test(
    fitted: Estimate, search: Search, probes: tuple[AbstractElement, ...], seed: int = 0
) -> ScoreTest:
    """Test the absent effects, all at once.

    With r the whitened residual, J the columns of fitted coefficients and nuisances, P = I - Q Q' and g = P
    g_j: `z = g.r / |g|`, strength `g.r / |g|^2`, visibility `|g| / |g_j|`, likeness `cos(g_i, g_j)`. Standard
    error, `sqrt(chi2/dof) / |g|` at one scatter of the stiffness, and p-value are over all scatters that the
    records allow.

    Args:
        fitted: the estimate to test.
        search: the scales of the campaign, and how much of a trace must be left.
        probes: absent effects at zero strength; those that follow signals which the records lack are left
            out.
        seed: of the draws for the family-wise p-value.

    Returns:
        The scores.

    Source: Rao 1948; Davies 1977 for parameters that mean nothing under the null; Westfall & Young 1993;
    Bayarri & Berger 2000, J. Am. Stat. Assoc. 95:1127 (p-values averaged over what a nuisance may be).
    """
    pointless = effects_without_signal(fitted.problem.records)
    probes = tuple(probe for probe in probes if probe.name not in pointless)
    count, carried = len(fitted.places), len(fitted.model.elements)
    units = np.array([1e-3 * probe.typical_strength(search.scales) for probe in probes])
    traces = project(fitted, probes, units)
    absorbed, seen = traces.absorbed, traces.visibility > search.rules.smallest_visibility
    information, score = traces.information, traces.score
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    safe = np.where(seen, np.maximum(size, 1e-300), np.inf)
    z = score / safe
    chosen = np.array([probe.phased for probe in probes], dtype=bool)
    mean, deviation = chosen_phase_law([record.output.size for record in fitted.problem.records])
    inflation = np.sqrt(fitted.inflation)
    z = np.where(chosen & seen, (z - mean * inflation) / deviation, z)

    # Within a family a shape of admissible sign goes before any other: the others are evidence against those
    # shapes.
    physical = np.array([probe.signed for probe in probes], dtype=bool) | (score > 0.0)
    weight = np.where(physical, np.abs(z), -1.0 / np.maximum(np.abs(z), 1e-300))
    best: dict[str, int] = {}
    for column, probe in enumerate(probes):
        if seen[column] and (probe.name not in best or weight[column] > weight[best[probe.name]]):
            best[probe.name] = column
    order = sorted(best.values(), key=lambda column: -abs(z[column]))
    correlation = information / np.outer(safe, safe)
    either = np.array([probe.signed for probe in probes], dtype=bool)
    shift = np.where(chosen, mean, 0.0), np.where(chosen, deviation, 1.0)
    all_scatters = _over_scatters(fitted, traces)
    family = _family_wise(_laws(all_scatters, seen, shift), order, seen, either, seed)
    errors = all_scatters.errors(score / safe**2)
    scores, steps, moved = [], [], []
    owner = fitted.simulator.prepared(traces.model, carried).record
    for column, p_value in zip(order, family, strict=True):
        probe = probes[column]
        amount = score[column] / size[column] ** 2
        step = absorbed[:, -1] - absorbed[:, column] * amount
        full = np.zeros(count + len(probes))
        full[:count], full[count + column] = step, amount
        unit = units[column]
        scores.append(
            Score(
                probe,
                float(z[column]),
                float(amount * unit),
                float(unit * errors[column]),
                float(traces.visibility[column]),
                float(p_value),
                bool(probe.signed or amount > 0.0),
                column,
            )
        )
        steps.append(step * traces.units)
        moved.append(step_nuisances(traces.point.reduced, owner, fitted.point.nuisances, full))
    hidden = tuple(sorted({probe.name for probe in probes} - set(best)))
    likeness = correlation[np.ix_(order, order)]
    return ScoreTest(tuple(scores), hidden, likeness, fitted, tuple(steps), tuple(moved))


def chosen_phase_law(lengths: Sequence[int]) -> tuple[float, float]:
    """Give mean and standard deviation of the score of a line of white noise whose phase each record chose.

    A record's share is the part of its line along the phase that `output_line` read: with C the coherence of
    the windowed line and the whole one, `C R + sqrt(1 - C^2) n`, R of Rayleigh's law and n normal.

    Args:
        lengths: samples of each record.

    Returns:
        Both, of the sum over the records divided by the square root of their number.
    """
    coherence = np.array([line_coherence(samples) for samples in lengths])
    mean = math.sqrt(0.5 * math.pi) * np.sum(coherence)
    variance = np.mean(1.0 - coherence**2 * (0.5 * math.pi - 1.0))
    return float(mean / math.sqrt(len(lengths))), float(np.sqrt(variance))


class _Law(NamedTuple):
    """Law of the scores without any effect at one scatter of the stiffness, and the scores.

    Attributes:
        weight: chance of this scatter, given the data and each probe by itself.
        correlation: of the scores that are seen.
        z: scores over their standard deviations, of all probes.
    """

    weight: Float[np.ndarray, " score"]
    correlation: Float[np.ndarray, "seen seen"]
    z: Float[np.ndarray, " score"]


def _over_scatters(fitted: Estimate, traces: Projection) -> ScatteredScores:
    """Give the scores at all scatters of the stiffness that the records allow."""
    inflation, reduced = fitted.inflation, traces.point.reduced
    if fitted.shows_scatter:
        found = scores_over_scatters(reduced, fitted.point.nuisances, inflation, len(fitted.places))
        if found is not None:
            return found
    own = traces.information[None] / inflation, traces.score[None] / inflation
    return ScatteredScores(np.ones_like(own[1]), *own)


def _laws(
    all_scatters: ScatteredScores,
    seen: Bool[np.ndarray, " score"],
    shift: tuple[Float[np.ndarray, " score"], Float[np.ndarray, " score"]],
) -> list[_Law]:
    """Give the law of the scores at each scatter.

    Args:
        all_scatters: the scores there.
        seen: which effects the data can show.
        shift: mean and standard deviation of each score where there is nothing but noise.
    """
    laws = []
    for weight, information, score in zip(*all_scatters, strict=True):
        size = np.where(seen, np.sqrt(np.maximum(np.diag(information), 1e-300)), np.inf)
        correlation = (information / np.outer(size, size))[np.ix_(seen, seen)]
        laws.append(_Law(weight, correlation, (score / size - shift[0]) / shift[1]))
    return laws


def _family_wise(
    laws: list[_Law],
    order: list[int],
    seen: Bool[np.ndarray, " score"],
    either: Bool[np.ndarray, " score"],
    seed: int,
) -> Float[np.ndarray, " family"]:
    """Give the chance that the largest score exceeds each that was found: by drawing, by Bonferroni far out.

    Both are means over the laws. Of an effect that has but one sign only that sign counts.

    Args:
        laws: of the scores.
        order: which scores are judged.
        seen: which scores the laws are about.
        either: which effects have either sign.
        seed: of the draws.
    """
    if not order:
        return np.zeros(0)
    random = np.random.default_rng(seed)
    typical = np.mean([law.weight[order] for law in laws], axis=1)
    counts = np.diff(np.round(NULL_DRAWS * np.cumsum(typical)).astype(int), prepend=0)
    drawn, bound = np.zeros(len(order)), np.zeros(len(order))
    most = np.sum(seen) + np.sum(either[seen])
    for law, count in zip(laws, counts.tolist(), strict=True):
        sizes, weight = np.where(either, np.abs(law.z), law.z)[order], law.weight[order]
        tail = np.minimum(1.0, most * stats.norm.sf(sizes))
        bound += weight * tail
        if count < FEWEST_EXCEEDANCES:
            drawn += weight * tail
            continue
        values, vectors = np.linalg.eigh(law.correlation)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        draws = random.standard_normal((count, root.shape[0])) @ root.T
        largest = np.where(either[seen], np.abs(draws), draws).max(axis=1)
        drawn += weight * np.mean(largest[:, None] >= sizes, axis=0)
    return np.where(drawn > FEWEST_EXCEEDANCES / NULL_DRAWS, drawn, bound)
