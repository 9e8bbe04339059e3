"""The score test: absent effects ride along at zero strength; what a refit would absorb is projected out."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy import stats

from ...elements import CATALOGUE, AbstractElement, Scales
from ...models import Isolator
from ..fitting import Estimate, Nuisances, Search, step_nuisances
from ..jacobian import effects_without_signal, line_coherence
from ._projection import project

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
        error: standard deviation of the strength for white noise [its unit].
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
    g_j: `z = g.r / |g|`, strength `g.r / |g|^2 +- 1 / |g|`, visibility `|g| / |g_j|`, likeness `cos(g_i,
    g_j)`.

    Args:
        fitted: the estimate to test.
        search: the scales of the campaign, and how much of a trace must be left.
        probes: absent effects at zero strength; those that follow signals which the records lack are left
            out.
        seed: of the draws for the family-wise p-value.

    Returns:
        The scores.

    Source: Rao 1948; Davies 1977 for parameters that mean nothing under the null; Westfall & Young 1993.
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
    lengths = [record.output.size for record in fitted.problem.records]
    mean, deviation = chosen_phase_law(lengths)
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
    sizes = np.where(either, np.abs(z), z)[order] / inflation
    family = _family_wise(correlation[np.ix_(seen, seen)], sizes, either[seen], seed)
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
                float(unit / size[column]),
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


def _family_wise(
    correlation: Float[np.ndarray, "score score"],
    sizes: Float[np.ndarray, " family"],
    either: Bool[np.ndarray, " score"],
    seed: int,
) -> Float[np.ndarray, " family"]:
    """Give the chance that the largest score exceeds each size: by drawing, and by Bonferroni far out.

    Of an effect that has but one sign only that sign counts.
    """
    if sizes.size == 0:
        return sizes
    values, vectors = np.linalg.eigh(correlation)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = np.random.default_rng(seed).standard_normal((NULL_DRAWS, root.shape[0])) @ root.T
    draws = np.where(either, np.abs(draws), draws).max(axis=1)
    drawn = np.mean(draws[:, None] >= sizes, axis=0)
    bound = np.minimum(1.0, (either.size + either.sum()) * stats.norm.sf(sizes))
    return np.where(drawn > FEWEST_EXCEEDANCES / NULL_DRAWS, drawn, bound)
