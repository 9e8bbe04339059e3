"""Records that could be measured next, ranked by what each is expected to say."""

import io
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._show import Row, amount, number, shown
from ..diagnosis import Experiment
from ._simulated_records import blank_records

_SHOWN = 6
"""Proposals that are printed."""


@shown
class Proposal(NamedTuple):
    """A record that could be measured next.

    Attributes:
        experiment: the test, of one record.
        level: its nominal level, in the campaign's own convention; its rms where the campaign declares none.
        standard_errors: of each coefficient once the record is fitted beside the others [its unit].
        quantity_errors: of each number of the quantity that was asked for; none without one.
        shrinkage: factor on the standard error of the quantity; without one, on those of all coefficients, as
            the geometric mean along the axes of their ellipsoid. NaN where nothing could be simulated.
        chi2: expected between the rival effects, over the present records and this one; NaN without rivals.
        reason: why it was left out; empty if it was not.
    """

    experiment: Experiment
    level: float
    standard_errors: Float[np.ndarray, " coefficient"]
    quantity_errors: Float[np.ndarray, " number"]
    shrinkage: float
    chi2: float
    reason: str = ""

    @property
    def schedule(self) -> str:
        """The schedule of a stepped sine as CSV, as campaign.toml takes it; empty for other drives."""
        (record,) = blank_records(self.experiment)
        if not record.dwells:
            return ""
        text = io.StringIO()
        text.write("start_s,frequency_hz,cycles\n")
        for dwell in record.dwells:
            text.write(f"{dwell.start / record.rate:.6f},{dwell.frequency:.6f},{dwell.cycles:g}\n")
        return text.getvalue()

    @property
    def declaration(self) -> str:
        """The record as campaign.toml declares it; its schedule stands in a file beside it."""
        name = self.experiment.name
        lines = ["[[record]]", f'file = "{name}.csv"']
        if self.experiment.waveform == "stepped sine":
            lines.append(f'schedule = "{name}_schedule.csv"')
        (record,) = blank_records(self.experiment)
        lines += [f"level = {self.level:.4g}", f'direction = "{record.direction}"', 'role = "fit"']
        lines += [f"{name} = {value:.6g}" for name, value in record.conditions]
        return "\n".join(lines) + "\n"

    def _headline(self) -> str:
        return f"{self.experiment.words}: {self._promise()}"

    def _promise(self) -> str:
        """Word what it is expected to do."""
        if self.reason:
            return self.reason
        return f"errors × {self.shrinkage:.3f}" if np.isnan(self.chi2) else f"chi2 {self.chi2:.3g}"


@shown
class NextTest(NamedTuple):
    """Which record to measure next.

    Attributes:
        names: of the fitted coefficients.
        units: of each.
        values: of each, as fitted.
        standard_errors: of each at present; NaN where the records do not determine it.
        quantity: value of the quantity that was asked for, flat; no numbers without one.
        quantity_errors: its standard errors at present.
        rivals: the effect and the other between which the test is to decide; none if not asked for.
        seconds: length of the record [s].
        proposals: the best first; those left out last.
        chi2_now: expected between the rival effects over the present records alone; NaN without rivals.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Float[np.ndarray, " coefficient"]
    standard_errors: Float[np.ndarray, " coefficient"]
    quantity: Float[np.ndarray, " number"]
    quantity_errors: Float[np.ndarray, " number"]
    rivals: tuple[str, ...]
    seconds: float
    proposals: tuple[Proposal, ...]
    chi2_now: float = float("nan")

    @property
    def best(self) -> Proposal | None:
        """The record to measure; None where none could be simulated."""
        return self.proposals[0] if self.proposals and not self.proposals[0].reason else None

    def _headline(self) -> str:
        if self.best is None:
            return "no record could be simulated"
        return f"{self.best.experiment.words}, {number(self.seconds)} s: {self.best._promise()}"

    def _rows(self) -> list[Row]:
        return [
            Row(f"{place}.", one._promise(), one.experiment.words)
            for place, one in enumerate(self.proposals[:_SHOWN], start=1)
        ]

    def _lines(self) -> list[str]:
        left_out = [one for one in self.proposals if one.reason]
        lines = [f"  … and {len(self.proposals) - _SHOWN} more"] if len(self.proposals) > _SHOWN else []
        reasons = list(dict.fromkeys(one.reason for one in left_out))
        lines += [f"  {len(left_out)} left out: {'; '.join(reasons)}"] if left_out else []
        if self.rivals:
            effect, other = self.rivals
            lines.append(
                f"  the present records alone: chi2 {self.chi2_now:.3g} between {effect} and {other}"
            )
        if self.best is None:
            return lines
        lines.append("  standard errors with the first, after ← now:")
        lines += [
            f"  {name}: {amount(value, unit)} ± {after:.2g} ← {now:.2g}"
            for name, unit, value, now, after in zip(
                self.names,
                self.units,
                self.values.tolist(),
                self.standard_errors.tolist(),
                self.best.standard_errors.tolist(),
                strict=True,
            )
        ]
        lines += [
            f"  quantity [{place}]: {value:.6g} ± {after:.2g} ← {now:.2g}"
            for place, (value, now, after) in enumerate(
                zip(
                    self.quantity.tolist(),
                    self.quantity_errors.tolist(),
                    self.best.quantity_errors.tolist(),
                    strict=True,
                )
            )
        ]
        return lines


def rank_proposals(proposals: list[Proposal]) -> tuple[Proposal, ...]:
    """Put the records first that determine most and shrink most, or that separate rivals farthest.

    Args:
        proposals: the records.

    Returns:
        The same in order; those left out last.
    """

    def key(one: Proposal) -> tuple[bool, float, int, float]:
        chi2 = 0.0 if np.isnan(one.chi2) else -one.chi2
        return bool(one.reason), chi2, -int(np.isfinite(one.standard_errors).sum()), one.shrinkage

    return tuple(sorted(proposals, key=key))
