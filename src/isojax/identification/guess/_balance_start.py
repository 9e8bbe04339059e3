"""The absent effect that balances the measured forces best: a start far from the fitted model."""

from typing import NamedTuple

from ..._parameters import own_parameters
from ...elements import AbstractElement, Scales
from ...models import Isolator
from ...records import Campaign
from ._dwell_balance import dwell_balance
from ._force_balance import ForceBalance
from ._measured_receptance import measured_receptance
from ._motion import measured_motion
from ._restoring_force import band_projections


class BalanceStart(NamedTuple):
    """What the balance of measured forces says of an absent effect.

    Attributes:
        element: the effect, of the shape and strength that leave least; of strength zero where none helps.
        model: the model with it, every coefficient from the balance.
        unexplained: rms of the force that it leaves unbalanced, as a share of the measured force [1].
        before: the same without it.
    """

    element: AbstractElement
    model: Isolator
    unexplained: float
    before: float

    @property
    def helps(self) -> bool:
        """Whether the forces balance better with it."""
        return self.unexplained < self.before


def find_balance_start(
    campaign: Campaign, model: Isolator, scales: Scales, absent: tuple[AbstractElement, ...]
) -> BalanceStart | None:
    """Find the absent effect without which the measured forces do not balance, if there is one.

    A score is a derivative at the fitted model. Where the model is far from the records (it may lack the
    spring that carries the mass), a search that starts from such a derivative is unreliable. The balance of
    measured motion and drive needs no simulation, and is linear in the strengths, however large they are.

    Args:
        campaign: the measurements; only records to fit are used.
        model: the fitted model, for its structure.
        scales: magnitudes of the records.
        absent: absent effects; of dwells every shape of their grids takes part, else those without internal
            states.

    Returns:
        The effect that leaves the smallest unbalanced force, or None if none leaves so little.

    Source: Masri & Caughey 1979.
    """
    kinds = dict.fromkeys(type(probe) for probe in absent)
    if all(record.dwells for record in campaign.fit_records):
        shapes = tuple(shape for kind in kinds for shape in kind.grid(scales))
    else:  # integrals of a motion drift, and laws that forget make up for that
        shapes = tuple(kind.guess(scales) for kind in kinds if not kind.internal_states)
    starts = balance_starts(campaign, model, shapes)
    return starts[0] if starts and starts[0].helps else None


def balance_starts(
    campaign: Campaign, model: Isolator, absent: tuple[AbstractElement, ...]
) -> list[BalanceStart]:
    """List the absent effects that take part in the balance of measured forces, the best first.

    Args:
        campaign: the measurements; only records to fit are used.
        model: the fitted model, for its structure.
        absent: absent effects, of any shapes.

    Returns:
        One a name, of the shape that leaves the smallest unbalanced force.
    """
    balance, names = _balance(campaign, model), tuple(element.name for element in model.elements)
    before, found = balance.fit(names), dict[str, BalanceStart]()
    for probe in absent:
        tried = balance.fit(names, probe)
        if probe.name not in tried.fitted:
            continue
        element = tried.model.elements[-1]
        strength = float(getattr(element, element.strength))
        lower = dict(own_parameters(element))[element.strength].lower
        useless = BalanceStart(probe, before.model, before.unexplained, before.unexplained)
        best = found.setdefault(probe.name, useless).unexplained
        if (element.signed or strength > 0.0) and strength > lower and tried.unexplained < best:
            found[probe.name] = BalanceStart(element, tried.model, tried.unexplained, before.unexplained)
    return sorted(found.values(), key=lambda one: one.unexplained)


def _balance(campaign: Campaign, model: Isolator) -> ForceBalance:
    """Give the balance that suits the records: of every dwell, or in time where a record has none."""
    records = campaign.fit_records
    if all(record.dwells for record in records):
        responses = tuple(measured_receptance(campaign, record) for record in records)
        return dwell_balance(model, responses, mass_free=campaign.mass_free)
    motions = tuple(measured_motion(campaign, record) for record in records)
    projections = band_projections(campaign, records, motions)
    return ForceBalance(model, motions, projections, campaign.mass_free)
