"""How far the data can be trusted, and how far they carry the findings."""

from typing import NamedTuple

from .._progress import step
from .._results import is_successful
from .._show import shown
from ..identification import DriftBudget, Loop, drift_budget
from ..records import DataHealth, HumLine, MainsCollision, data_health, hum_lines, mains_collisions
from ._dwell_stability import DwellStability, dwell_stability


@shown
class CampaignHealth(NamedTuple):
    """State of the data and of what was found in them.

    Attributes:
        data: what the records alone show.
        hum: lines of the mains that stand out of records.
        collisions: dwells in which a harmonic falls on the mains; where hum is seen, on its line only.
        dwells: each dwell beside the final model's periodic orbit; none where the fit failed.
        budget: how far repeatability limits the final model's coefficients.
    """

    data: DataHealth
    hum: tuple[HumLine, ...]
    collisions: tuple[MainsCollision, ...]
    dwells: tuple[DwellStability, ...]
    budget: DriftBudget


def campaign_health(loop: Loop) -> CampaignHealth:
    """Look after the data of a closed loop, with its final model.

    Args:
        loop: the closed loop.

    Returns:
        Their health.
    """
    after = loop.after
    step("dwells beside the periodic orbits of the model")
    dwells = dwell_stability(after.model, loop.campaign) if is_successful(after.result) else ()
    records = loop.campaign.records
    step("noise, hum and drift of the records")
    return CampaignHealth(
        data_health(loop.campaign),
        tuple(line for record in records for line in hum_lines(record)),
        mains_collisions(records),
        dwells,
        drift_budget(after),
    )
