"""One measured record: the two channels in SI, how they were excited, and the dwells of a stepped sine."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from jaxtyping import Float

from .._quantities import CONDITIONS
from .._show import Row, number, shown

_Answer = TypeVar("_Answer")

Direction = Literal["forward", "backward", "none"]
Role = Literal["fit", "holdout"]
ExcitationKind = Literal["stepped_sine", "periodic", "swept", "free_decay", "impulse", "broadband"]


@shown
@dataclass(frozen=True)
class Dwell:
    """A segment of a stepped sine at one frequency.

    Attributes:
        start: First sample, counted from the start of the record.
        stop: One past the last sample.
        frequency: Excitation frequency [Hz].
        cycles: Number of cycles.
    """

    start: int
    stop: int
    frequency: float
    cycles: float

    def _headline(self) -> str:
        return (
            f"{number(self.frequency)} Hz, {number(self.cycles)} cycles, samples {self.start} to {self.stop}"
        )


_NO_MEAN = 1e-6
"""Mean of an output over its standard deviation below which it was subtracted."""


@shown
@dataclass(frozen=True, eq=False)
class Record:
    """One measurement on a uniform time grid.

    Attributes:
        name: File stem, made unique where two records would share it.
        file: Where it was read from.
        time: Seconds since the record's first sample.
        rate: Samples per second [Hz].
        input: Force on the mass [N] (from a reaction mass: -moving_mass * acceleration), base acceleration
            [m/s^2], or gain * command; 0 in a free decay, where the channel shows its own noise.
        output: Acceleration [m/s^2], velocity [m/s] or displacement [m].
        raw_input: The input before the reader's [filter], and as measured in a free decay; elsewhere the same
            array where the reader does not filter.
        raw_output: The output before the reader's [filter].
        level: Nominal excitation level, or None.
        direction: Direction of the sweep.
        repeat: Number of the repetition, or None.
        role: "fit" or "holdout".
        period: Samples per period of a periodic excitation, or None.
        settle: Samples at the start that count in no error.
        dwells: Dwells of a stepped sine, else empty.
        kind: What the excitation is.
        clock: Start and end of the record as shares of the whole test, 0 to 1.
        start: Sample of its file with which the record starts; the clocks of the channels ran from sample 0.
        floor: Measured acceleration of the floor about its mean [m/s^2], or None.
        time_jitter: rms by which its time column departs from the even grid, beyond its rounding [s]; 0 where
            it has none.
        resampled: Whether its channels were brought from such times to the even grid, as campaign.toml asks.
        removed_spikes: Samples of both channels that the reader replaced, as campaign.toml asks for.
        held: Samples before its start, of those that campaign.toml names, at which the mass was held still.
        pressure: Absolute pressure in the chamber during the record [Pa], or None.
        temperature: Absolute temperature during the record [K], or None.
    """

    name: str
    file: Path
    time: Float[np.ndarray, " time"]
    rate: float
    input: Float[np.ndarray, " time"]
    output: Float[np.ndarray, " time"]
    raw_input: Float[np.ndarray, " time"]
    raw_output: Float[np.ndarray, " time"]
    level: float | None = None
    direction: Direction = "none"
    repeat: int | None = None
    role: Role = "fit"
    period: int | None = None
    settle: int = 0
    dwells: tuple[Dwell, ...] = ()
    kind: ExcitationKind = "broadband"
    clock: tuple[float, float] = (0.0, 1.0)
    start: int = 0
    floor: Float[np.ndarray, " time"] | None = None
    time_jitter: float = 0.0
    resampled: bool = False
    removed_spikes: int = 0
    held: int = 0
    pressure: float | None = None
    temperature: float | None = None
    _kept: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False)

    def once(self, question: Hashable, work: Callable[[], _Answer]) -> _Answer:
        """Gives what `work` returns, computed when the question is first asked and then kept."""
        if question not in self._kept:
            self._kept[question] = work()
        return self._kept[question]

    @property
    def conditions(self) -> tuple[tuple[str, float], ...]:
        """Operating conditions that are stated, by name [SI]; repeats have equal ones."""
        stated = ((name, getattr(self, name)) for name in CONDITIONS)
        return tuple((name, value) for name, value in stated if value is not None)

    def lacks_mean(self, quantity: str) -> bool:
        """Says whether a mean of the motion was subtracted; of all quantities a displacement has one."""
        return quantity == "displacement" and bool(abs(self.output.mean()) < _NO_MEAN * self.output.std())

    @property
    def rings_down(self) -> bool:
        """Whether the motion decays freely, after a release or a blow."""
        return self.kind in ("free_decay", "impulse")

    @property
    def periods(self) -> Float[np.ndarray, "period time"]:
        """The output's whole periods after the settle samples, up to the end; none without a period."""
        length = self.period or self.output.size + 1
        count = max(self.output.size - self.settle, 0) // length
        return self.output[self.output.size - count * length :].reshape(count, length)

    def _headline(self) -> str:
        kind = self.kind.replace("_", " ")
        length = f"{number(self.output.size / self.rate)} s at {number(self.rate)} Hz"
        role = "to fit" if self.role == "fit" else "held out"
        released = f", released after {number(self.held / self.rate)} s" if self.held else ""
        return f"{self.name}: {kind}{released}, {self.output.size} samples, {length}, {role}"

    def _rows(self) -> list[str | Row]:
        met = [dwell.frequency for dwell in self.dwells]
        span = f"{len(met)}, {number(min(met))} to {number(max(met))} Hz" if met else "none"
        optional = ("level", "repeat", "period", "floor", *CONDITIONS)
        given = [name for name in optional if getattr(self, name) is not None]
        return ["input", "output", Row("dwells", span), "direction", "settle", *given, "file"]
