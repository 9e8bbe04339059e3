"""Starts far from a good fit: the absent effect that balances the measured forces best."""

from typing import NamedTuple

import numpy as np

from ..._parameters import own_parameters
from ...elements import AbstractElement, Scales
from ...models import Isolator
from ...records import Campaign
from .._rules import Rules
from ._dwell_balance import fit_all_dwells
from ._force_balance import BalanceFit
from ._measured_receptance import measured_receptance
from ._motion import measured_motion
from ._restoring_force import fit_restoring_force
from ._scales import excited_centre


class BalanceStart(NamedTuple):
    """An absent effect that the balance of measured forces asks for.

    Attributes:
        element: the effect, at the strength found.
        model: the model with it, every coefficient from the balance.
        unexplained: rms of the force that it leaves unbalanced, as a share of the measured force [1].
        before: the same without it.
    """

    element: AbstractElement
    model: Isolator
    unexplained: float
    before: float


def find_balance_start(
    campaign: Campaign,
    model: Isolator,
    scales: Scales,
    absent: tuple[AbstractElement, ...],
    rules: Rules,
) -> BalanceStart | None:
    """Find the absent effect without which the measured forces do not balance, if there is one.

    A score is a derivative at the fitted model. Where that is far from the records (a mass on a spring that
    the model does not have) the derivative says little, and the descent from it ends anywhere. The balance of
    measured motion and drive needs no simulation and is linear in the strengths, however large.

    Args:
        campaign: the measurements; only records to fit are looked at.
        model: the fitted model, for its structure.
        scales: magnitudes of the records.
        absent: absent effects; those without internal states take part.
        rules: how much less an effect must leave unbalanced than the structure alone; what is no dwell.

    Returns:
        The effect that leaves least unbalanced, or None if none leaves so little.

    Source: Masri & Caughey 1979.
    """
    if any(element.internal_states for element in model.elements):
        return None
    records = campaign.fit_records
    names = tuple(element.name for element in model.elements)
    if all(record.dwells for record in records):
        responses = tuple(measured_receptance(campaign, record, rules) for record in records)

        def balance(structure: Isolator, fitted: tuple[str, ...]) -> BalanceFit:
            return fit_all_dwells(structure, fitted, responses, mass_free=campaign.mass_free)
    else:
        motions = tuple(measured_motion(campaign, record) for record in records)
        centres = tuple(
            excited_centre(record, motion) / (2 * np.pi)
            for record, motion in zip(records, motions, strict=True)
        )
        offset_free = campaign.input.offset_free or campaign.output.offset_free

        def balance(structure: Isolator, fitted: tuple[str, ...]) -> BalanceFit:
            return fit_restoring_force(
                structure,
                fitted,
                motions,
                centres,
                campaign.rate,
                campaign.output.quantity,
                offset_free,
                campaign.mass_free,
            )

    before = balance(model, names).unexplained
    found: list[BalanceStart] = []
    for name in dict.fromkeys(probe.name for probe in absent):
        probe = next(one for one in absent if one.name == name)
        tried = balance(model.with_elements(type(probe).guess(scales)), (*names, name))
        if name in tried.fitted:
            element = tried.model.elements[-1]
            strength = float(getattr(element, element.strength))
            lower = dict(own_parameters(element))[element.strength].lower
            if (element.signed or strength > 0.0) and strength > lower:
                found.append(BalanceStart(element, tried.model, tried.unexplained, before))
    best = min(found, key=lambda one: one.unexplained, default=None)
    return best if best is not None and best.unexplained < rules.much_better * before else None
