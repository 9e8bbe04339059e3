"""Records that the test rig of a campaign could measure next: level, band, waveform and direction."""

import itertools
from collections.abc import Sequence

import numpy as np

from ..._quantities import CONDITIONS
from ..._show import number
from ...records import Campaign
from ..diagnosis import DWELLS, Conditions, Experiment, Waveform
from ._candidate_experiments import HIGHEST, WAVEFORM_WORDS
from ._test_outline import MOST_STEPS, TestOutline
from ._trial_drive import drive_of

_DIRECTIONS: dict[Waveform, tuple[bool, ...]] = {
    "stepped sine": (False, True),
    "swept sine": (False, True),
    "multisine": (False,),
}
"""Whether the frequency falls, of the records of each waveform."""

USUAL_DWELLS = 3, 6, 12
"""Dwells of a stepped sine: long ones tell more of each motion, many more of the curve."""


def outline_of_record(outline: TestOutline, seconds: float, substeps: int) -> TestOutline:
    """Give the outline with segments as long as a record of so many seconds has them.

    Args:
        outline: what the campaign did.
        seconds: length of the record [s].
        substeps: integration steps a sample.

    Returns:
        The outline; a long record is simulated in part.
    """
    samples = min(seconds * outline.rate / DWELLS, max(MOST_STEPS / substeps, outline.samples))
    # Even, so that each of twice as many dwells has whole samples.
    return outline._replace(samples=2 * int(np.ceil(0.5 * samples)))


def usual_levels(outline: TestOutline) -> tuple[float, ...]:
    """Give the levels of the campaign and a third of the lowest: no farther than the model was tested."""
    return (outline.levels[0] / 3.0, *outline.levels)


def usual_bands(outline: TestOutline) -> tuple[tuple[float, float], ...]:
    """Give the band of the campaign, its halves, its middle, and the band carried on either way [Hz]."""
    low, high = outline.lowest, outline.highest
    middle, quarter = 0.5 * (low + high), 0.25 * (high - low)
    upper = min(2.0 * high, HIGHEST * outline.rate)
    bands = (
        (low, high),
        (low, middle),
        (middle, high),
        (low + quarter, high - quarter),
        (0.5 * low, high),
        (low, upper),
    )
    return tuple(band for band in bands if band[1] > band[0])


def record_candidates(
    campaign: Campaign,
    outline: TestOutline,
    levels: Sequence[float],
    bands: Sequence[tuple[float, float]],
    dwells: Sequence[int],
    conditions: Sequence[Conditions],
) -> tuple[Experiment, ...]:
    """Give the records, in the order of their waveforms and numbers of dwells.

    Args:
        campaign: the measurements.
        outline: length and sampling rate.
        levels: rms of the drive [its SI unit].
        bands: lowest and highest frequency of each [Hz].
        dwells: of a stepped sine.
        conditions: operating conditions; none where the campaign states none.

    Returns:
        Experiments of one record each.
    """
    unit = "m/s²" if campaign.input.quantity == "base_acceleration" else "N"
    found = []
    hows: list[tuple[Waveform, int, bool]] = [
        (waveform, count, backward)
        for waveform, directions in _DIRECTIONS.items()
        for count in (dwells if waveform == "stepped sine" else (DWELLS,))
        for backward in directions
    ]
    asked = itertools.product(hows, levels, bands, conditions or [()])
    for (waveform, count, backward), level, (low, high), at in asked:
        steps = f" in {count} dwells" if waveform == "stepped sine" else ""
        way = "" if waveform == "multisine" else ", downwards" if backward else ", upwards"
        there = "".join(f" at {number(value)} {CONDITIONS[name]}" for name, value in at)
        words = (
            f"{WAVEFORM_WORDS[waveform]} of {level:.3g} {unit} rms, {low:.3g} to {high:.3g} Hz{way}{steps}"
            f"{there}"
        )
        name = f"{waveform}_{level:.3g}_{low:.3g}_{high:.3g}{way}{steps}{there}"
        name = name.replace(", ", "_").replace(" ", "_")
        drive = drive_of(outline, (level,), low, high, waveform, backward, count)
        found.append(
            Experiment(
                name,
                words,
                drive,
                outline.rate,
                campaign.output.quantity,
                waveform,
                lacking=_lacking(outline, waveform, low, high),
                backward=backward,
                dwells=count,
                conditions=(at,) if at else (),
            )
        )
    return tuple(found)


def _lacking(outline: TestOutline, waveform: Waveform, low: float, high: float) -> str:
    """Say why a record cannot be measured in a band; "" if it can."""
    if high > HIGHEST * outline.rate:
        return "the sampling rate is too low for its band"
    seconds = DWELLS * outline.samples / outline.rate
    lines = waveform != "multisine" or np.floor(high * seconds) >= np.ceil(low * seconds)
    return "" if low * seconds >= 1.0 and lines else "the record is too short for its band"
