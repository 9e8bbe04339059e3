"""A tone in the residual that does not belong to the drive: a machine nearby, a pump, the mains."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import signal, stats

from ..._show import number, shown
from ...records.spectrum import USABLE_SHARE, harmonic_basis, usable_orders, without
from .._rules import Rules
from ._errors import Run
from ._fit_result import Fit
from ._lack_of_fit import HIGHEST_ORDER, lack_of_fit, shows_noise

_LINES_OF_A_TONE = 3
"""Lines to either side of one that its own power reaches through the window."""

_LINES_OF_NOISE = 8
"""Lines beyond these, on either side, that show the noise there."""

_LINES_A_FREEDOM = 1.5
"""Neighbouring lines of a Hann window that hold as much as one independent line."""


@shown
class Tone(NamedTuple):
    """A line of the residual.

    Attributes:
        frequency: of the line [Hz].
        rms: of its signal, over all fitted records [SI unit of the output].
        p_value: chance of a line as high at any frequency where there is noise alone.
    """

    frequency: float
    rms: float
    p_value: float

    def words(self, unit: str) -> str:
        """Give what it means, without a full stop.

        Args:
            unit: SI unit of the output.
        """
        return (
            f"A tone at {self.frequency:.4g} Hz ({self.rms:.3g} {unit} rms) is not locked to the drive: "
            "something that no channel records shakes the mass or its sensor"
        )

    def _headline(self) -> str:
        return f"{number(self.frequency)} Hz, {number(self.rms)} rms"


def unlocked_tone(fit: Fit, rules: Rules = Rules()) -> Tone | None:
    """Find a tone that neither the model nor the drive explains.

    What comes back with each cycle of the drive is taken out of the residual first. In each record the power
    of a line is compared with that of the lines beside it, so that noise of any smooth spectrum has none.
    The chances of all records together tell whether one frequency stands out.

    Args:
        fit: the fit; its fitted records count, each segment restarted from its own best state.
        rules: the level of significance.

    Returns:
        The most significant tone; None where there is none, where no record has a drive that repeats, and
        where the residual is locked to the drive: a wrong model has transients, which are lines as well.

    Source: Fisher 1929, Proc. R. Soc. A 125:54 (largest line of a periodogram); Fisher 1932, Statistical
    Methods for Research Workers, sec. 21.1 (several tests together).
    """
    if lack_of_fit(fit).p_value < rules.significance:
        return None
    tone = strongest_tone([run for run in fit.restarts.runs if run.record.role == "fit"])
    return tone if tone is not None and tone.p_value < rules.significance else None


def strongest_tone(runs: Iterable[Run]) -> Tone | None:
    """Find the line that stands out most from the residual of records, as `unlocked_tone` does.

    Args:
        runs: the records, each segment restarted from its own best state.

    Returns:
        The line with its chance, significant or not; None where no record shows lines.
    """
    meant = [run for run in runs if shows_noise(run.record)]
    rests = [_unlocked(run) for run in meant]
    if not rests or not all(np.all(np.isfinite(rest)) for rest, _ in rests):
        return None
    size = max(rest.size for rest, _ in rests)
    lines = [_lines(rest, kept, size) for rest, kept in rests]
    first = max(one.first for one in lines)
    last = min(one.first + one.chance.size for one in lines)
    if first >= last:
        return None
    chances = np.stack([one.chance[first - one.first : last - one.first] for one in lines])
    together = stats.chi2.logsf(-2.0 * np.log(chances).sum(axis=0), 2 * len(lines))
    place = int(np.argmin(together))
    squares = [one.square[first - one.first + place] for one in lines]
    return Tone(
        (first + place) * meant[0].record.rate / size,
        float(np.sqrt(max(np.mean(squares), 0.0))),
        float(min(1.0, np.exp(together[place]) * together.size)),
    )


def _unlocked(run: Run) -> tuple[Float[np.ndarray, " time"], float]:
    """Give the residual without what repeats with the drive, and the share of noise that this leaves."""
    record, rest = run.record, run.residual.copy()
    if record.period is not None and not record.dwells:
        count = (rest.size - record.settle) // record.period
        whole = rest[rest.size - count * record.period :].reshape(count, record.period)
        return (whole - whole.mean(axis=0)).ravel(), (count - 1) / count
    for dwell in record.dwells:
        part = slice(dwell.start, dwell.stop)
        orders = usable_orders(record.rate, dwell.frequency, HIGHEST_ORDER)
        time = np.arange(dwell.stop - dwell.start) / record.rate
        rest[part] = without(harmonic_basis(time, dwell.frequency, orders), rest[part])
    return rest, 1.0


class _Lines(NamedTuple):
    """Lines of one record.

    Attributes:
        first: number of the first.
        chance: that noise alone has a line as high beside such neighbours.
        square: mean square of the tone that the line would be.
    """

    first: int
    chance: Float[np.ndarray, " line"]
    square: Float[np.ndarray, " line"]


def _lines(rest: Float[np.ndarray, " time"], kept: float, size: int) -> _Lines:
    """Compare each line with those beside it.

    Args:
        rest: what does not repeat.
        kept: share of the noise that is left at the lines beside one, on average.
        size: samples to which zeros make it longer.

    Returns:
        The lines.
    """
    window = signal.get_window("hann", rest.size)
    power = np.abs(np.fft.rfft(rest * window, size)) ** 2
    wider = size / rest.size
    near, far = (
        int(np.ceil(_LINES_OF_A_TONE * wider)),
        int(np.ceil((_LINES_OF_A_TONE + _LINES_OF_NOISE) * wider)),
    )
    beside = np.ones(2 * far + 1)
    beside[far - near : far + near + 1] = 0.0
    level = np.convolve(power, beside / (kept * beside.sum()), "valid")
    own = power[far : power.size - far]
    own, level = (one[: int(2 * USABLE_SHARE * power.size) - far] for one in (own, level))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(level > 0.0, own / level, 0.0)
    chance = stats.f.sf(ratio, 2, 2 * int(2 * _LINES_OF_NOISE / _LINES_A_FREEDOM))
    return _Lines(far, np.maximum(chance, 1e-300), 2.0 * (own - level) / np.sum(window) ** 2)
