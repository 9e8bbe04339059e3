"""Candidate experiments: what the test rig of a campaign could also do.

All of them have records of equal length, so that one compiled simulation serves them all.
"""

from typing import Any

from ...models import Quantity
from ...records import Campaign
from ..diagnosis import AGAIN, Experiment, Waveform
from ._test_outline import TestOutline
from ._trial_drive import drive_of

HIGHEST = 0.4
"""Highest frequency that is driven, as a share of the sampling rate."""

EXTRA_MASS = 0.1
"""Share of the isolated mass that is bolted on."""

WAVEFORM_WORDS: dict[Waveform, str] = {
    "stepped sine": "a stepped sine",
    "swept sine": "a swept sine",
    "multisine": "a random-phase multisine",
}


def repeated_campaign(campaign: Campaign, outline: TestOutline) -> Experiment:
    """Give the test that the campaign was."""
    levels = _levels(outline)
    return Experiment(
        AGAIN,
        "repeat the same test",
        drive_of(outline, levels, outline.lowest, outline.highest, outline.waveform),
        outline.rate,
        campaign.output.quantity,
        outline.waveform,
        conditions=tuple(one for one in outline.conditions for _ in outline.levels),
    )


def _levels(outline: TestOutline) -> tuple[float, ...]:
    """Give the level of each record: all of them at each operating condition."""
    return outline.levels * max(len(outline.conditions), 1)


def candidate_experiments(campaign: Campaign, outline: TestOutline, load: float) -> tuple[Experiment, ...]:
    """Give the tests that could be made, the yardstick first.

    Args:
        campaign: the measurements.
        outline: what they did.
        load: static force that shifts the rest position by the amplitude of the motion [N].

    Returns:
        The experiments.
    """
    again = repeated_campaign(campaign, outline)
    levels, low, high = _levels(outline), outline.lowest, outline.highest
    unit = "m/s^2" if campaign.input.quantity == "base_acceleration" else "N"

    def driven(name: str, words: str, *how: Any, lacking: str = "") -> Experiment:
        return again._replace(
            name=name, words=words, drive=drive_of(outline, *how), waveform=how[-1], lacking=lacking
        )

    below, above = outline.levels[0] / 3.0, 1.5 * outline.levels[-1]
    limit = HIGHEST * outline.rate
    upper = min(2.0 * high, limit)
    narrow = "" if upper > 1.2 * high else "the sampling rate leaves no room above the band"
    middle = outline.levels[len(outline.levels) // 2]
    span = f"from {low:.3g} to {high:.3g} Hz"
    other: Waveform = "stepped sine" if outline.waveform == "multisine" else "multisine"
    mass = EXTRA_MASS * campaign.mass
    quantity: Quantity = "displacement"
    return (
        again,
        driven(
            "lower_level",
            f"repeat the test at a third of the lowest level ({below:.3g} {unit} rms)",
            (below,) * len(levels),
            low,
            high,
            outline.waveform,
        ),
        driven(
            "higher_level",
            f"repeat the test at 1.5 times the top level ({above:.3g} {unit} rms)",
            (above,) * len(levels),
            low,
            high,
            outline.waveform,
        ),
        driven(
            "band_up",
            f"extend the band up to {upper:.3g} Hz",
            levels,
            low,
            upper,
            outline.waveform,
            lacking=narrow,
        ),
        driven(
            "band_down",
            f"extend the band down to {0.5 * low:.3g} Hz",
            levels,
            0.5 * low,
            high,
            outline.waveform,
        ),
        again._replace(
            name="extra_mass",
            words=f"bolt a known {mass:.3g} kg onto the isolator and repeat the test",
            extra_mass=mass,
        ),
        again._replace(
            name="static_load",
            words=f"put a known static load of {load:.3g} N on the isolator and repeat the test",
            load=load,
            lacking="" if load > 0.0 else "no spring would hold a static load",
        ),
        driven(
            "other_waveform",
            f"drive {WAVEFORM_WORDS[other]} {span} at the middle level ({middle:.3g} {unit} rms)",
            (middle,) * len(levels),
            low,
            high,
            other,
        ),
        again._replace(
            name="dc_sensor",
            words="measure the displacement, mean included, with a DC-capable sensor in place of the present "
            "one and repeat the test",
            quantity=quantity,
            lacking="the campaign has such a sensor" if campaign.output.quantity == quantity else "",
        ),
    )
