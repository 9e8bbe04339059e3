"""Experiments ranked by how far each would separate a finding from its look-alikes."""

from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._show import Row, number, shown
from ...elements import CATALOGUE
from ...models import Quantity

Waveform = Literal["stepped sine", "swept sine", "multisine"]

DWELLS = 6
"""Segments of a simulated record, each with a state of its own, and dwells of a stepped sine unless it says
otherwise."""

AGAIN = "again"
"""Name of the yardstick: the campaign once more."""


Conditions = tuple[tuple[str, float], ...]
"""Operating conditions by name [SI], such as (("pressure", 2e5),)."""


@shown
class Experiment(NamedTuple):
    """A test that could be made.

    Attributes:
        name: in one word.
        words: what to do.
        drive: recorded drive of each record, one period of what may be repeated [N, or m/s^2 of the base].
        rate: samples a second [Hz].
        quantity: what the sensor measures.
        waveform: what drives it; the sine of a step lasts for a segment of the record.
        extra_mass: known mass that is bolted on [kg].
        load: known static force on the mass [N].
        lacking: why the campaign's test rig cannot make it; empty if it can.
        backward: whether the frequency falls in the first record; the next goes the other way.
        dwells: of a stepped sine, in each record.
        conditions: operating conditions of each record, by name [SI]; none where the campaign states none.
    """

    name: str
    words: str
    drive: Float[np.ndarray, "record time"]
    rate: float
    quantity: Quantity
    waveform: Waveform
    extra_mass: float = 0.0
    load: float = 0.0
    lacking: str = ""
    backward: bool = False
    dwells: int = DWELLS
    conditions: tuple[Conditions, ...] = ()

    @property
    def seconds(self) -> float:
        """Measuring time of one period of all records [s]."""
        return self.drive.size / self.rate

    def _headline(self) -> str:
        return f"{self.words}, {number(self.seconds)} s"


@shown
class Prospect(NamedTuple):
    """What an experiment promises.

    Attributes:
        experiment: the test.
        gains: expected chi2, per max(chi2/dof, 1) of the fit, by which the effect would explain the old data
            and the new better than each look-alike does; empty where it was left out.
        reason: why it was left out; empty if it was not.
    """

    experiment: Experiment
    gains: tuple[float, ...]
    reason: str = ""

    @property
    def gain(self) -> float:
        """The smallest expected chi2 over all look-alikes; NaN where it was left out."""
        return min(self.gains, default=float("nan"))

    def separated(self, needed: float) -> int:
        """Count the look-alikes that it separates.

        Args:
            needed: expected chi2 that separates two effects.

        Returns:
            How many.
        """
        return sum(gain >= needed for gain in self.gains)

    def _headline(self) -> str:
        return f"{self.experiment.words}: {self.reason or f'expected chi2 {number(self.gain)}'}"


@shown
class Separation(NamedTuple):
    """Which test separates a finding from its look-alikes.

    Attributes:
        effect: catalogue name of the finding.
        others: catalogue names of its look-alikes.
        prospects: the candidate tests: most pairs separated first, then by their smallest gain; those left
            out last.
        needed: expected chi2 that separates two effects.
        seconds: measuring time of the new test [s].
    """

    effect: str
    others: tuple[str, ...]
    prospects: tuple[Prospect, ...]
    needed: float
    seconds: float

    @property
    def best(self) -> Prospect | None:
        """The test to make; None where none could be simulated."""
        return self.prospects[0] if self.prospects and self.prospects[0].gains else None

    @property
    def again(self) -> Prospect | None:
        """What the campaign once more would promise; None where it could not be simulated."""
        known = (one for one in self.prospects if one.experiment.name == AGAIN and one.gains)
        return next(known, None)

    @property
    def words(self) -> str:
        """The test to make with what it promises; empty where none could be simulated."""
        best = self.best
        if best is None:
            return ""
        separated = best.separated(self.needed)
        words = best.experiment.words
        if separated == 0:
            return (
                f"No test that was simulated separates them: the best, {words}, has an expected chi2 of "
                f"{self._promise(best)} where {self.needed:.2g} is needed."
            )
        promise = self._promise(best)
        apart = promise if " from " in promise else f"{promise} apart"
        beside = "" if best is self.again else f" (repeating the same test: {self._promise(self.again)})"
        line = f"{words[0].upper()}{words[1:]}: expected chi2 {apart} after {self.seconds:.3g} s{beside}."
        left = [
            CATALOGUE[name].words
            for name, gain in zip(self.others, best.gains, strict=True)
            if gain < self.needed
        ]
        return f"{line} It does not separate it from: {', '.join(left)}." if left else line

    def _promise(self, prospect: "Prospect | None") -> str:
        """Word the gains: one number a look-alike, named where there are several."""
        gains = () if prospect is None else prospect.gains
        numbers = [f"{gain:.3g}" if round(gain, 1) else "0.0" for gain in gains]
        if len(numbers) == 1 or len(set(numbers)) == 1:
            return numbers[0]
        named = zip(numbers, self.others, strict=True)
        return ", ".join(f"{number} from {CATALOGUE[name].words}" for number, name in named)

    def _headline(self) -> str:
        return self.words or "no test could be simulated"

    def _rows(self) -> list[Row]:
        return [
            Row(one.experiment.name, one.reason or f"expected chi2 {number(one.gain)}", one.experiment.words)
            for one in self.prospects
        ]


def rank_prospects(prospects: tuple[Prospect, ...], needed: float) -> tuple[Prospect, ...]:
    """Put the tests that separate most pairs, and separate them farthest, first.

    Args:
        prospects: the tests.
        needed: expected chi2 that separates two effects.

    Returns:
        The same tests in order; those left out last.
    """

    def key(one: Prospect) -> tuple[bool, int, float]:
        separated = [gain for gain in one.gains if gain >= needed]
        return bool(one.gains), len(separated), min(separated or one.gains, default=0.0)

    return tuple(sorted(prospects, key=key, reverse=True))
