"""Data health in words: measured dwells beside folds, and what repeatability leaves of each finding."""

import math
from collections.abc import Sequence

from ..._parameters import list_parameters
from ..._quantities import (
    INPUT_WORDS,
    finite_or_none,
    typeset_number,
    typeset_share,
    typeset_unit,
    typeset_with_error,
)
from ...health import REACH, CampaignHealth, DwellStability
from ...identification import DriftBudget, Finding, Fit, plain_unit
from ._sentences import effect_words, own_strength, scatter_words

_MOST_NAMED = 6

_NEAR = 0.05
"""A fold within this share of the drive counts as near."""


def place_words(dwell: DwellStability) -> str:
    """Give the words for a dwell.

    Args:
        dwell: the dwell.

    Returns:
        Such as "up_30N at 4.40 Hz".
    """
    return f"{dwell.record} at {dwell.dwell.frequency:.2f} Hz"


def dwell_words(dwells: Sequence[DwellStability], quantity: str) -> tuple[str, ...]:
    """Give how near the measured dwells are to folds, by the fitted model.

    Args:
        dwells: of all records.
        quantity: what the input is.

    Returns:
        A sentence each; none without dwells.
    """
    known = [one for one in dwells if not one.reason]
    lines = [] if not known else [_fold_words(known, INPUT_WORDS[quantity][1]), _settling_words(known)]
    lost = [one for one in dwells if one.reason]
    if lost:
        others = len({one.reason for one in lost}) - 1
        lines.append(
            f"{len(lost)} of {len(dwells)} dwells left out (for example {place_words(lost[0])}): "
            f"{lost[0].reason.rstrip('.')}" + (f" (or {others} other reasons)." if others else ".")
        )
    return tuple(lines)


def _fold_words(known: Sequence[DwellStability], unit: str) -> str:
    """Say how near the dwells come to a fold."""

    def change(dwell: DwellStability) -> list[float]:
        sizes = (dwell.nearness, abs(dwell.fold_frequency))
        return [size if math.isfinite(size) else math.inf for size in sizes]

    nearest = min(known, key=change)
    away = []
    if math.isfinite(nearest.nearness):
        newtons = f"{typeset_number(abs(nearest.fold_amplitude), 2)} {typeset_unit(unit)}"
        away.append(f"{newtons} ({typeset_share(nearest.nearness)} of the drive)")
    if math.isfinite(nearest.fold_frequency):
        away.append(f"{typeset_number(abs(nearest.fold_frequency), 2)} Hz")
    if not away:
        return (
            "By the fitted model, no dwell has a fold (a jump) on its branch within "
            f"{100 * REACH[0]:.0f} % of its drive or {100 * REACH[1]:.0f} % of its frequency."
        )
    near = sum(one.nearness < _NEAR for one in known)
    return (
        f"By the fitted model, the nearest fold (a jump) is {' or '.join(away)} from "
        f"{place_words(nearest)}; {near} of {len(known)} dwells are within {100 * _NEAR:.0f} % of the drive "
        "of one. Close to a fold a small drift changes the motion a lot."
    )


def _settling_words(known: Sequence[DwellStability]) -> str:
    """Say how slowly disturbances die out."""
    slowest = max(known, key=lambda one: one.spectral_radius)
    radius = slowest.spectral_radius
    words = f"|μ| is at most {typeset_number(radius, 3)} ({place_words(slowest)})"
    if radius < 1.0:
        cycles = math.ceil(math.log(0.01) / math.log(max(radius, 1e-9)))
        return f"{words}: there a disturbance decays to 1 % in {cycles} cycles."
    count = sum(one.spectral_radius >= 1.0 for one in known)
    return f"{words}: by the model {count} of the measured dwells are unstable."


def mains_words(health: CampaignHealth, unit: str) -> tuple[str, ...]:
    """Give where the mains hum, and under which harmonics.

    Args:
        health: of the campaign.
        unit: of the output.

    Returns:
        A sentence each; none where no hum is seen and none could hide.
    """
    met = {(round(one.dwell.frequency, 2), one.order, one.mains) for one in health.collisions}
    places = [
        f"dwell at {frequency:.2f} Hz: harmonic {order} falls on {mains:g} Hz"
        for frequency, order, mains in sorted(met)
    ]
    shown = "; ".join(places[:_MOST_NAMED]) + (
        f"; {len(places) - _MOST_NAMED} more" if places[_MOST_NAMED:] else ""
    )
    if not health.hum:
        hidden = f"No hum of the mains stands out; where it could hide: {shown}."
        return (hidden,) if places else ()
    lines = []
    for frequency in sorted({one.frequency for one in health.hum}):
        own = [one.amplitude for one in health.hum if one.frequency == frequency]
        lines.append(
            f"Hum of the mains at {frequency:g} Hz in {len(own)} records, up to "
            f"{typeset_number(max(own), 2)} {typeset_unit(unit)}; it does not count as noise."
        )
    if places:
        lines.append(
            f"Where hum falls on a harmonic of a dwell, that harmonic is left out of its summary: {shown}."
        )
    return tuple(lines)


def budget_words(budget: DriftBudget, fit: Fit, findings: Sequence[Finding]) -> tuple[str, ...]:
    """Give how far repeatability limits each finding.

    Args:
        budget: of the final fit.
        fit: the final fit.
        findings: what was found.

    Returns:
        A sentence a finding; none where the scatter is not known.
    """
    lines = []
    for finding in findings:
        entry, error = own_strength(fit, finding.effect)
        share = budget.of(entry.name)
        if share is None or not math.isfinite(error):
            continue
        unit = typeset_unit(plain_unit(share.unit, fit.campaign))
        found = typeset_with_error(share.value, error, plain_unit(share.unit, fit.campaign))
        lines.append(
            f"Repeatability limits {effect_words(finding.effect)}, {entry.spec.symbol} = {found}, to "
            f"± {typeset_number(share.repeatability, 2)} {unit}; noise alone to "
            f"± {typeset_number(share.noise, 2)} {unit}. If the scatter of the stiffness "
            f"({scatter_words(budget.scatter, budget.within)}) were ignored, it would appear "
            f"as a false ± {typeset_number(share.if_ignored, 2)} {unit}."
        )
    return tuple(" ".join(line.split()) for line in lines)


def budget_rows(budget: DriftBudget, fit: Fit) -> list[tuple[str, str, str, str, str, str]]:
    """Give the drift budget as rows of a table.

    Args:
        budget: of the final fit.
        fit: the final fit.

    Returns:
        Name, value with error, error by noise alone, by repeatability, its value if the scatter were
        ignored, share of repeatability in the variance.
    """
    symbols = {entry.name: entry.spec.symbol for entry in list_parameters(fit.model)}
    rows = []
    for share in budget.shares:
        unit = plain_unit(share.unit, fit.campaign)
        whole = share.standard_error**2
        rows.append(
            (
                share.name,
                f"{symbols[share.name]} = {typeset_with_error(share.value, share.standard_error, unit)}",
                typeset_number(share.noise, 2),
                typeset_number(share.repeatability, 2),
                typeset_number(share.if_ignored, 2),
                typeset_share(share.repeatability**2 / whole if whole > 0.0 else math.nan),
            )
        )
    return rows


def health_dict(health: CampaignHealth) -> dict[str, object]:
    """Give the health of a campaign for result.json.

    Args:
        health: dwells, hum and drift budget.

    Returns:
        Numbers and words; None where a number is not finite. A dwell without a reason and without folds has
        none within reach.
    """
    return {
        "dwells": [
            {
                "record": one.record,
                "frequency": finite_or_none(one.dwell.frequency),
                "amplitude": finite_or_none(one.amplitude),
                "spectral_radius": finite_or_none(one.spectral_radius),
                "fold_amplitude": finite_or_none(one.fold_amplitude),
                "fold_frequency": finite_or_none(one.fold_frequency),
                "reason": one.reason,
            }
            for one in health.dwells
        ],
        "hum": [
            {
                "record": one.record,
                "frequency": finite_or_none(one.frequency),
                "amplitude": finite_or_none(one.amplitude),
            }
            for one in health.hum
        ],
        "mains_collisions": [
            {
                "record": one.record,
                "frequency": finite_or_none(one.dwell.frequency),
                "harmonic": one.order,
                "mains": finite_or_none(one.mains),
            }
            for one in health.collisions
        ],
        "stiffness_scatter": finite_or_none(health.budget.scatter),
        "stiffness_scatter_within_records": finite_or_none(health.budget.within),
        "repeatability": {
            share.name: {
                "noise": finite_or_none(share.noise),
                "repeatability": finite_or_none(share.repeatability),
                "pretended": finite_or_none(share.if_ignored),
            }
            for share in health.budget.shares
        },
    }
