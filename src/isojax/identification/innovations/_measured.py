"""The records of a fit, tabulated for as many integration steps as a model needs."""

import numpy as np
from jaxtyping import Float

from ...excitations import Hold
from ...models import Integrator, Quantity
from ...records import Record
from ..jacobian import Segment, Tables


class Measured:
    """Records to fit, each from its first sample to its last.

    A single record is cut in the middle, so that one half can predict the other.
    """

    def __init__(
        self,
        records: tuple[Record, ...],
        quantity: Quantity,
        hold: Hold,
        noise: Float[np.ndarray, " record"],
    ):
        """Keep the records; nothing is tabulated yet.

        Args:
            records: equal in rate.
            quantity: what the sensor measures.
            hold: what the drive does between samples.
            noise: rms that the noise of each record cannot exceed [SI unit of the output].
        """
        self.records = records
        self.quantity: Quantity = quantity
        self.hold: Hold = hold
        ends = [(place, 0, record.output.size, record.settle) for place, record in enumerate(records)]
        if len(records) == 1:
            (place, start, stop, settle), middle = ends[0], records[0].output.size // 2
            ends = [(place, start, middle, settle), (place, middle, stop, middle)]
        self.segments = tuple(Segment(*each) for each in ends)
        self.loudest = 2.0 * np.log(noise[[one.record for one in self.segments]])
        self._tables: dict[int, Tables] = {}

    def tables(self, steps: int) -> Tables:
        """Give the tables for so many integration steps a sample."""
        if steps not in self._tables:
            self._tables[steps] = Tables(
                self.records, self.segments, self.quantity, self.hold, Integrator(substeps=steps)
            )
        return self._tables[steps]
