"""The records of a fit, tabulated for as many integration steps as a model needs."""

import itertools

import numpy as np
from jaxtyping import Bool, Float

from ...excitations import Hold
from ...models import Integrator, Quantity
from ...records import Record, thin_record
from ..jacobian import Segment, Tables

_MOST_FOLDS = 4
"""Parts of the records of which each is left out in turn, at most."""


class Measured:
    """Records to fit, each from its first sample to its last.

    A single record is cut in the middle, so that one half can predict the other.

    Attributes:
        zeros: standard deviation of the zero of each segment's displacement [m]: its rms where the mean of
            its record was removed, else 0.
    """

    def __init__(
        self,
        records: tuple[Record, ...],
        quantity: Quantity,
        hold: Hold,
        noise: Float[np.ndarray, " record"],
        factor: int = 1,
        force: tuple[float, float] = (0.0, np.inf),
        scatter: float = 0.0,
    ):
        """Keep the records; nothing is tabulated yet.

        Args:
            records: equal in rate.
            quantity: what the sensor measures.
            hold: what the drive does between samples.
            noise: rms that the noise of each record cannot exceed [SI unit of the output].
            factor: samples that become one, see `thin_record`.
            force: rms of the random force at least and at most, as declared [SI unit of the drive].
            scatter: standard deviation of the linear stiffness from record to record, to start from
                [relative]; 0 where all records have one stiffness.
        """
        recorded, records = records, tuple(thin_record(record, factor) for record in records)
        self.records, self._factor, self.force, self.scatter = records, factor, force, scatter
        self.quantity: Quantity = quantity
        self.hold: Hold = hold
        ends = [(place, 0, record.output.size, record.settle) for place, record in enumerate(records)]
        if len(records) == 1:
            (place, start, stop, settle), middle = ends[0], records[0].output.size // 2
            ends = [(place, start, middle, settle), (place, middle, stop, middle)]
        self.segments = tuple(Segment(*each) for each in ends)
        zeros = [one.output.std() if one.lacks_mean(quantity) else 0.0 for one in recorded]
        self.zeros = np.array([zeros[one.record] for one in self.segments])
        self.loudest = 2.0 * np.log(noise[[one.record for one in self.segments]])
        self._tables: dict[int, Tables] = {}

    @property
    def folds(self) -> tuple[Bool[np.ndarray, " segment"], ...]:
        """Segments that are left out together, fold by fold."""
        places = np.arange(len(self.segments))
        folds = min(_MOST_FOLDS, places.size)
        return tuple(places % folds == fold for fold in range(folds))

    def others(self, records: tuple[Record, ...]) -> tuple["Measured", int]:
        """Give other records of the campaign, prepared alike.

        Args:
            records: the records.

        Returns:
            As many as these, some repeated where they are fewer: a filter then needs no other compiled code.
            And how many of the segments come first and repeat none.
        """
        count = max(len(records), len(self.records))
        repeated = tuple(itertools.islice(itertools.cycle(records), count))
        other = Measured(repeated, self.quantity, self.hold, np.ones(count), self._factor, self.force)
        return other, len(records) * len(other.segments) // count

    def tables(self, steps: int) -> Tables:
        """Give the tables for so many integration steps a sample."""
        if steps not in self._tables:
            self._tables[steps] = Tables(
                self.records, self.segments, self.quantity, self.hold, Integrator(substeps=steps)
            )
        return self._tables[steps]
