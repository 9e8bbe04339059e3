"""The response of the identified model, with its bands, at the drive amplitudes that were measured."""

from typing import NamedTuple

import numpy as np

from ..._progress import step
from ..._quantities import CONDITIONS
from ..._results import is_successful
from ...identification import ClassicalGuess, Loop, MeasuredResponse, measured_receptance
from ...models import HALF_WIDTH, Estimated, fit_at
from ...records import Campaign
from ...records.spectrum import driven_range
from ...stability import ResponseBands, response_bands
from ..plots import drive_unit, median_drive, quantity
from ..words import typeset_number, typeset_with_error

_ONE_LEVEL_RATIO = 1.1
"""Ratio of drive amplitudes below which they are one level."""

_MOST_CURVES_SHOWN = 4
"""Curves in a picture that can still be told apart."""

_WIDER = 1.05
"""The band of frequencies that is shown, over that of the dwells, at either end."""

_AROUND = 4.0
"""How far a picture without dwells goes from the resonance, as a ratio of frequencies."""

_VARIES = 0.05
"""Departure of the drive of a dwell from its level, as a share, that is worth a word."""

_GAPS = 0.01
"""Share of orbits that were not found that is worth a word."""


class IdentifiedResponse(NamedTuple):
    """What the section on the response of the identified model shows.

    Attributes:
        lines: sentences of the section; why it is left out, where it is.
        bands: the curves; None where there are none.
        measured: dwells of all records.
        captions: of the two pictures.
    """

    lines: tuple[str, ...]
    bands: ResponseBands | None = None
    measured: tuple[MeasuredResponse, ...] = ()
    captions: tuple[str, str] = ("", "")


class _Sines(NamedTuple):
    """Sine tests that stand for those of a campaign: drive amplitudes, lowest first, and frequencies [Hz]."""

    amplitudes: tuple[float, ...]
    frequencies: tuple[float, float]
    lines: tuple[str, ...]


def identified_response(loop: Loop) -> IdentifiedResponse:
    """Work out the response of the identified model at the drive amplitudes of the records.

    Args:
        loop: the closed loop.

    Returns:
        What the section shows.
    """
    campaign, fit = loop.campaign, loop.after
    reason = _why_not(loop)
    if reason:
        return IdentifiedResponse((f"The response is not shown: {reason}.",))
    step("response of the identified model")
    measured = tuple(measured_receptance(campaign, record) for record in campaign.records if record.dwells)
    measured = tuple(one for one in measured if one.frequency.size)
    sines = _sines(campaign, loop.guess, measured, fit)
    if isinstance(sines, str):
        return IdentifiedResponse((f"The response is not shown: {sines}.",))
    estimated, lines = _at_conditions(fit, campaign)
    bands = response_bands(estimated, sines.amplitudes, sines.frequencies)
    if not bands.curves:
        return IdentifiedResponse(
            ("The response is not shown: no periodic motion was found at the measured drive amplitudes.",)
        )
    lines = (_fold_words(bands), *sines.lines, *lines)
    if bands.lost > _GAPS:
        lines += (
            f"{100.0 * bands.lost:.0f} % of the motions that were tried do not exist or were not found; "
            "curves end there.",
        )
    return IdentifiedResponse(lines, bands, measured, _captions(bands, measured))


def _why_not(loop: Loop) -> str:
    """Say why no response can be given; "" if one can."""
    fit = loop.after
    if not is_successful(fit.result):
        return "the last fit failed"
    sizes = np.diag(np.asarray(fit.covariance))
    lost = [name for name, size in zip(fit.free, sizes, strict=True) if not np.isfinite(size)]
    return f"the records do not determine {', '.join(lost)}" if lost else ""


def _sines(
    campaign: Campaign, guess: ClassicalGuess, measured: tuple[MeasuredResponse, ...], fit: Estimated
) -> _Sines | str:
    """Give sine tests that stand for the records, or say why there are none."""
    if measured:
        amplitudes = [median_drive(one, fit.model) for one in measured]
        frequency = np.concatenate([one.frequency for one in measured])
        band = float(frequency.min()) / _WIDER, float(frequency.max()) * _WIDER
        lines: tuple[str, ...] = ()
    else:
        driven = [one for one in campaign.records if not one.rings_down and np.any(one.input)]
        # A line counts as far as the drive explains it: noise over the square of a low frequency is large.
        resonances = [
            one.frequency[np.argmax(one.coherence * np.abs(one.receptance))]
            for one in guess.linear
            if one.frequency.size
        ]
        if not driven or not resonances:
            return "no record is driven for longer than a blow, so that no drive amplitude is known"
        amplitudes = [float(np.sqrt(2.0) * np.std(one.input[one.settle :])) for one in driven]
        lowest, highest = zip(*(driven_range(one) for one in driven), strict=True)
        low, high = min(lowest) / _WIDER, max(highest) * _WIDER
        peak = min(max(float(np.median(resonances)), low), high)  # of a blow it may lie beyond the drives
        band = max(low, peak / _AROUND), min(high, peak * _AROUND)
        lines = (
            "The records have no dwells: the curves are those of sines with the rms of the measured drives.",
        )
    amplitudes.sort()
    groups = np.split(
        np.array(amplitudes), 1 + np.flatnonzero(np.diff(np.log(amplitudes)) > np.log(_ONE_LEVEL_RATIO))
    )
    levels = [float(np.median(group)) for group in groups]
    if len(levels) > _MOST_CURVES_SHOWN:
        lines += (f"{_MOST_CURVES_SHOWN} of {len(levels)} drive amplitudes are shown.",)
        places = np.linspace(0, len(levels) - 1, _MOST_CURVES_SHOWN).round().astype(int)
        levels = [levels[place] for place in places]
    return _Sines(tuple(levels), band, lines)


def _at_conditions(fit: Estimated, campaign: Campaign) -> tuple[Estimated, tuple[str, ...]]:
    """Give a fit in the middle of the operating conditions that its coefficients follow, and say so."""
    followed = fit.model.conditions
    if not followed:
        return fit, ()
    stated = [dict(record.conditions) for record in campaign.records]
    middle = {name: float(np.median([one[name] for one in stated if name in one])) for name in followed}
    words = " and ".join(f"{name} {quantity(value, CONDITIONS[name])}" for name, value in middle.items())
    return fit_at(fit, **middle), (
        f"Coefficients follow {' and '.join(followed)}; the curves are at {words}.",
    )


def _fold_words(bands: ResponseBands) -> str:
    """Say where the response jumps, and how probable folds are."""
    unit, jumps, chances = drive_unit(bands.model.excitation), [], []
    for amplitude, share in zip(bands.amplitudes, bands.fold_probability, strict=True):
        folds = [fold for one in bands.curves if one.amplitude == amplitude for fold in one.folds]
        if folds:
            places = [
                typeset_with_error(
                    one.frequency, 0.5 * (one.interval[1] - one.interval[0]) / HALF_WIDTH, "Hz"
                )
                for one in sorted(folds)
            ]
            jumps.append(f"at {quantity(amplitude, unit)} at {' and '.join(places)}")
        if 0.0 < share < 1.0:
            chances.append(f"{typeset_number(share, 2)} at {quantity(amplitude, unit)}")
    if jumps:
        words = f"The response jumps (folds) {'; '.join(jumps)}."
    else:
        words = (
            "At these drive amplitudes the fitted model has one steady response per frequency: "
            "no fold, so no jump."
        )
    if chances:
        listed = ", ".join(chances)
        return f"{words} Within the errors of the coefficients, it folds with probability {listed}."
    return f"{words} All models drawn within the errors of the coefficients agree."


def _captions(bands: ResponseBands, measured: tuple[MeasuredResponse, ...]) -> tuple[str, str]:
    """Give a caption to each picture."""
    based = bands.model.excitation == "base_acceleration"
    relative = " relative to the base" if based else ""
    response = f"Steady response to a sine of constant amplitude{relative}; {_at_peak(bands, 'displacement')}"
    departures = [np.abs(one.force[:, 0] / np.median(np.abs(one.force[:, 0]))) for one in measured]
    worst = max((float(np.max(np.abs(one - 1.0))) for one in departures), default=0.0)
    if worst > _VARIES:
        response += (
            f" The measured drive departs from its level by up to {100.0 * worst:.0f} %, so that dwells lie "
            "off their curve, and further off where the response is steep."
        )
    passes = (
        "Absolute motion over that of the base" if based else "Force on the ground over the force on the mass"
    )
    isolates = "the isolator isolates below 1"
    return response, f"{passes}: {isolates}; {_at_peak(bands, 'transmissibility')}"


def _at_peak(bands: ResponseBands, what: str) -> str:
    """Say how wide the band is where the curves are highest."""
    highest = max(bands.curves, key=lambda curve: float(np.max(getattr(curve, what))))
    place = int(np.argmax(getattr(highest, what)))
    share = HALF_WIDTH * float(highest.standard_error[what][place] / getattr(highest, what)[place])
    return (
        f"the band (95 %, errors of the coefficients) is ±{typeset_number(100.0 * share, 2)} % at the peak."
    )
