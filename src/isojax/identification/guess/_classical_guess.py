"""The start of every identification: classical analysis of the records, without a simulation."""

import dataclasses
from pathlib import Path
from typing import Literal

from ..._cores import in_own_threads
from ..._parameters import list_parameters
from ..._show import Row, amount, shown
from ..._types import check_float64
from ...models import Isolator
from ...records import Campaign
from ._as_campaign import as_campaign
from ._declared_model import base_model, declared_names
from ._force_balance import BalanceFit
from ._linear_response import LinearResponse
from ._logarithmic_decrement import Decrement
from ._measured_receptance import MeasuredResponse, measured_receptance
from ._paper_table import PaperTable, paper_table
from ._sensor_offset_start import with_sensor_zero
from ._start_coefficients import start_from_dwells, start_from_time

_HARDLY_BALANCED = 0.7
"""Share of the force left unbalanced above which the reader is asked to check sign, unit, timing and mass."""


@shown
@dataclasses.dataclass(frozen=True, eq=False)
class ClassicalGuess:
    """The result of classical analysis of a campaign.

    Attributes:
        model: the declared structure with the estimated coefficients; where the fit starts.
        route: where they come from: "all_dwells" (harmonic balance of every dwell) or "restoring_force"
            (force balance in time).
        unexplained: rms of the force that `model` leaves unbalanced, as a share of the measured force [1].
        responses: measured receptance of each stepped-sine record to fit.
        table: resonances and equivalent laws of the paper's route; None without stepped-sine records.
        bias: by parameter name, the paper's route over `model`, less one [1].
        linear: best linear receptance of each driven record without dwells.
        decrements: logarithmic decrement of each free decay, by record name.
        notes: what the reader must know, a sentence each.

    Source: the paper, secs. 3 and 4.
    """

    model: Isolator
    route: Literal["all_dwells", "restoring_force"]
    unexplained: float
    responses: tuple[MeasuredResponse, ...]
    table: PaperTable | None
    bias: dict[str, float]
    linear: tuple[LinearResponse, ...]
    decrements: dict[str, Decrement]
    notes: tuple[str, ...]

    @property
    def paper_model(self) -> Isolator | None:
        """The isolator of the paper's own route, averaged over sweep directions; None if it gives none."""
        return None if self.table is None else self.table.model

    def _headline(self) -> str:
        how = "harmonic balance of all dwells" if self.route == "all_dwells" else "force balance in time"
        return f"start values by {how}, which leave {100.0 * self.unexplained:.3g} % of the force unbalanced"

    def _rows(self) -> list[Row]:
        return [
            Row(
                one.name,
                amount(one.value, one.spec.unit),
                f"{one.spec.symbol}; the paper's route {100.0 * self.bias[one.name]:+.3g} %"
                if one.name in self.bias
                else one.spec.symbol,
            )
            for one in self.model.parameters
        ]

    def _lines(self) -> list[str]:
        return [f"  {note}" for note in self.notes]


def _bias(paper: Isolator | None, model: Isolator) -> dict[str, float]:
    """Give, for the parameters that both models have, the one over the other, less one."""
    if paper is None:
        return {}
    reference = {entry.name: float(entry.value) for entry in list_parameters(model)}
    return {
        entry.name: float(entry.value) / reference[entry.name] - 1.0
        for entry in list_parameters(paper)
        if entry.name != "mass" and reference.get(entry.name, 0.0) != 0.0
    }


def _cautions(
    campaign: Campaign, found: BalanceFit, responses: tuple[MeasuredResponse, ...]
) -> tuple[str, ...]:
    """Give a sentence for each ambiguity of the declaration and each doubt that the balance raises."""
    left_out = [
        f"{response.record} at {', '.join(f'{frequency:.4g}' for frequency in response.left_out)} Hz"
        for response in responses
        if response.left_out.size
    ]
    notes = (
        [f"Dwells left out because they were not steady or not driven: {'; '.join(left_out)}."]
        if left_out
        else []
    )
    if campaign.mass_free and campaign.input.gain_free:
        notes.append("Mass and input gain cannot be separated: the mass stays as declared.")
    if campaign.mass_free and found.model.excitation == "base_acceleration":
        notes.append("Base excitation determines ratios to the mass only: the mass stays as declared.")
    if campaign.lacks_mean:
        notes.append(
            "The mean of the displacement was removed, and the rest of the mass with it: each record is "
            "fitted with a zero of its own."
        )
    if found.unexplained > _HARDLY_BALANCED:
        notes.append(
            f"The start leaves {found.unexplained:.0%} of the force unbalanced: check sign, unit and timing "
            "of both channels, and the mass."
        )
    return tuple(notes)


@in_own_threads
def classical_guess(
    campaign: Campaign | str | Path,
    *,
    damping: Literal["half_power", "circle"] = "half_power",
    resonance: Literal["peak", "phase"] = "peak",
) -> ClassicalGuess:
    """Guess the coefficients of the declared structure by classical analysis.

    Stepped-sine records give the harmonic balance of every dwell; where there are none, the force balance in
    time. The paper's own route, by resonance points and half power, is reported with its bias. Further
    elements of the campaign (`elements = [...]`) start absent.

    Args:
        campaign: the campaign, or the path of its campaign.toml or its folder; only records with role "fit"
            are used.
        damping: where the paper's route takes its damping ratio from.
        resonance: which resonance the paper's route takes.

    Returns:
        The start of a fit, with the measurements that it comes from.

    Raises:
        ValueError: if the campaign names an effect that is not in the catalogue, or has no record to fit.
        RuntimeError: if JAX is not in 64-bit mode.

    Example:
        With the campaign of `read_campaign`'s example:

        >>> guess = ij.classical_guess(campaign)
        >>> [element.name for element in guess.model.elements]
        ['linear_stiffness', 'cubic_stiffness', 'linear_damping']
    """
    check_float64()
    campaign = as_campaign(campaign)
    base = base_model(campaign)
    names = declared_names(campaign, extra=False)
    mass_free = campaign.mass_free and not campaign.input.gain_free
    dwelling = [record for record in campaign.fit_records if record.dwells]
    responses = tuple(measured_receptance(campaign, record) for record in dwelling)
    others = tuple(record for record in campaign.fit_records if not record.dwells)
    in_time = start_from_time(campaign, base, names, others, mass_free) if others else None
    if responses:
        found, notes = start_from_dwells(base, names, responses, mass_free)
        table = paper_table(responses, campaign.mass, damping, resonance)
    else:
        assert in_time is not None
        found, notes, table = in_time.fit, in_time.notes, None
    return ClassicalGuess(
        model=with_sensor_zero(campaign, found.model),
        route="all_dwells" if responses else "restoring_force",
        unexplained=found.unexplained,
        responses=responses,
        table=table,
        bias=_bias(None if table is None else table.model, found.model),
        linear=() if in_time is None else in_time.linear,
        decrements={} if in_time is None else in_time.decrements,
        notes=(*_cautions(campaign, found, responses), *notes, *(() if table is None else table.notes)),
    )
