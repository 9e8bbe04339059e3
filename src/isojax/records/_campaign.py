"""A measurement campaign: its channels, its filter, the model named for it, and its records in test order."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from .._show import Row, headline, listed, number, shown
from ._record import Record

InputQuantity = Literal["force", "base_acceleration", "reaction_mass_acceleration", "command"]
OutputQuantity = Literal["acceleration", "velocity", "displacement"]
Hold = Literal["band_limited", "linear", "zero_order"]
"""As in `isojax.excitations`, which stands beside this room: neither imports the other."""

TIME_DERIVATIVES: Mapping[OutputQuantity, int] = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""How often the displacement is differentiated to give each quantity."""

_RECORDS_SHOWN = 16
"""Records of a campaign that are shown one by one."""


@shown
@dataclass(frozen=True)
class InputChannel:
    """What drove the isolator.

    Attributes:
        quantity: What the column measures.
        column: Its name in the file.
        unit: Its unit in the file.
        gain: Input in SI = gain * column in SI; N/V where the column is a voltage.
        gain_free: Whether the gain is to be identified.
        offset_free: Whether a constant offset of the input is to be identified.
        hold: How the input runs between two samples.
        moving_mass: Mass [kg] of a reaction-mass exciter, else None.
        noise: Declared rms of white noise in SI, or None.
        accuracy: Error of the reading, as a share of it, or None.
        remove_spikes: Whether the reader replaces single samples that their neighbours do not explain.
    """

    quantity: InputQuantity
    column: str
    unit: str
    gain: float = 1.0
    gain_free: bool = False
    offset_free: bool = False
    hold: Hold = "band_limited"
    moving_mass: float | None = None
    noise: float | None = None
    accuracy: float | None = None
    remove_spikes: bool = False


@shown
@dataclass(frozen=True)
class OutputChannel:
    """What was measured on the isolated mass.

    Attributes:
        quantity: Acceleration, velocity or displacement.
        column: Its name in the file.
        unit: Its unit in the file.
        offset_free: Whether a constant offset of the output is to be identified.
        noise: Declared rms noise in SI, or None to estimate it.
        accuracy: Error of the reading, as a share of it, or None.
        remove_spikes: Whether the reader replaces single samples that their neighbours do not explain.
    """

    quantity: OutputQuantity
    column: str
    unit: str
    offset_free: bool = False
    noise: float | None = None
    accuracy: float | None = None
    remove_spikes: bool = False


@shown
@dataclass(frozen=True)
class FloorChannel:
    """What was measured on the floor under the isolator.

    Attributes:
        quantity: Acceleration, velocity or displacement.
        column: Its name in the file.
        unit: Its unit in the file.
        gain: Motion in SI = gain * column in SI.
    """

    quantity: OutputQuantity
    column: str
    unit: str
    gain: float = 1.0


@shown
@dataclass(frozen=True)
class Filter:
    """Low-pass filter on all channels alike.

    Attributes:
        kind: "butterworth".
        order: Order of the filter; run forwards and backwards it acts twice.
        cutoff_hz: Cut-off frequency [Hz].
        applied: True: the test rig filtered; False: the reader does, with zero phase.
        compensate: Whether the reader inverts the filter of the test rig, a digital one that ran once.
    """

    kind: Literal["butterworth"]
    order: int
    cutoff_hz: float
    applied: bool = True
    compensate: bool = False


@shown
@dataclass(frozen=True, eq=False)
class Campaign:
    """Everything campaign.toml says, with the records read.

    Attributes:
        title: Name of the campaign.
        file: The campaign.toml.
        mass: Isolated mass [kg].
        mass_free: Whether the mass is to be identified.
        input: The input channel.
        output: The output channel.
        filter: The filter, or None.
        rate: Samples per second [Hz], of every record.
        stiffness: Catalogue names of the stiffness terms, as written in [model].
        damping: Catalogue names of the damping terms, as written in [model].
        elements: Further catalogue names.
        records: The records in the order of the test in time.
        floor: The channel of the floor's motion, or None.
        random_force: Declared rms of a white force that stands for what the model does not know [SI unit of
            the input], or None.
    """

    title: str
    file: Path
    mass: float
    mass_free: bool
    input: InputChannel
    output: OutputChannel
    filter: Filter | None
    rate: float
    stiffness: tuple[str, ...]
    damping: tuple[str, ...]
    elements: tuple[str, ...]
    records: tuple[Record, ...]
    floor: FloorChannel | None = None
    random_force: float | None = None

    @property
    def accuracy(self) -> float:
        """Declared error of both channels together, as a share of the reading; 0 where none is declared."""
        return math.hypot(self.input.accuracy or 0.0, self.output.accuracy or 0.0)

    @property
    def fit_records(self) -> tuple[Record, ...]:
        """Records that may set a coefficient."""
        return tuple(record for record in self.records if record.role == "fit")

    @property
    def lacks_mean(self) -> bool:
        """Whether the mean of a displacement to fit was removed: each record then has a zero of its own."""
        return any(record.lacks_mean(self.output.quantity) for record in self.fit_records)

    @property
    def holdout_records(self) -> tuple[Record, ...]:
        """Records that only evaluate a fit."""
        return tuple(record for record in self.records if record.role == "holdout")

    @property
    def timing(self) -> str:
        """The rate, and the frequencies of the dwells, which a wrong rate makes others than those driven."""
        driven = [dwell.frequency for record in self.records for dwell in record.dwells]
        dwells = f", dwells of {number(min(driven))} to {number(max(driven))} Hz" if driven else ""
        return f"{number(self.rate)} samples/s{dwells}{self._scatter}"

    @property
    def _scatter(self) -> str:
        """How far the times scatter about an even grid at most, in words; "" where they do not."""
        worst = max(self.records, key=lambda record: record.time_jitter)
        if worst.time_jitter == 0.0:
            return ""
        share = 100.0 * worst.time_jitter * worst.rate
        how = "resampled" if worst.resampled else "taken as even"
        return f", {how} from times that scatter by {share:.2g} % of a step"

    def _headline(self) -> str:
        fitted, held_out = len(self.fit_records), len(self.holdout_records)
        return f"{self.title}: {len(self.records)} records, {fitted} to fit and {held_out} held out"

    def _rows(self) -> list[Row]:
        declared = (*self.stiffness, *self.damping, *self.elements)
        filtered = "none"
        if self.filter is not None:
            by = "test rig" if self.filter.applied else "reader"
            filtered = (
                f"{self.filter.kind} of order {self.filter.order}, {self.filter.cutoff_hz:g} Hz, by the {by}"
            )
        return [
            Row("mass", f"{number(self.mass)} kg, {'to be identified' if self.mass_free else 'as declared'}"),
            Row("input", f"{self.input.quantity.replace('_', ' ')}, column {self.input.column}"),
            Row("output", f"{self.output.quantity}, column {self.output.column}"),
            *(
                []
                if self.floor is None
                else [Row("floor", f"{self.floor.quantity}, column {self.floor.column}")]
            ),
            Row("filter", filtered),
            Row("rate", self.timing),
            Row("model", listed(declared, 20)),
            Row("file", str(self.file)),
        ]

    def _lines(self) -> list[str]:
        first = self.records[:_RECORDS_SHOWN]
        more = len(self.records) - len(first)
        return [f"  {headline(record)}" for record in first] + (
            [f"  and {more} records more"] if more else []
        )
