"""Tables of records that a model is simulated over: made when they are first asked for, and kept."""

from ...excitations import Hold
from ...models import Integrator, Isolator, Quantity
from ...records import Record
from ._batch import Prepared, prepare
from ._segments import Segment


class Tables:
    """Segments of records as one simulation after the other takes them.

    They depend on the delay, on its growth and on the steps a sample only, and are remade when those change
    and at no other time.
    """

    def __init__(
        self,
        records: tuple[Record, ...],
        segments: tuple[Segment, ...],
        quantity: Quantity,
        hold: Hold,
        integrator: Integrator,
        whitening: tuple[float, ...] = (),
    ):
        """Keep what does not change; nothing is tabulated yet.

        Args:
            records: the records, equal in rate.
            segments: pieces of them.
            quantity: what the sensor measures.
            hold: what the drive does between samples.
            integrator: solver and steps.
            whitening: see `Prepared`.
        """
        self.records, self.segments = records, segments
        self.quantity: Quantity = quantity
        self.hold: Hold = hold
        self.integrator, self.whitening = integrator, whitening
        self._prepared: dict[tuple[int, float, float], Prepared] = {}

    def forget(self) -> None:
        """Drop the tables, which are large; they are made again when they are next asked for."""
        self._prepared.clear()

    def prepared(self, model: Isolator, carried: int) -> Prepared:
        """Give the tables for a model.

        Args:
            model: the isolator.
            carried: count of its elements that move the state (probes need no finer steps).

        Returns:
            The tables.

        Raises:
            ValueError: if an effect follows signals that no record has.
        """
        for element in model.elements:
            element.check_record()
        steps = self.integrator.table_steps(Isolator(model.mass, model.elements[:carried], model.excitation))
        key = (steps, float(model.shift()), float(model.skew()))
        channels = set(model.channels)
        known = set(self._prepared[key].batches[0].channels) if key in self._prepared else set()
        if key not in self._prepared or not channels <= known:
            # What is known already stays known: the tables serve models with and without their followers.
            self._prepared.clear()
            self._prepared[key] = prepare(
                self.records,
                self.segments,
                quantity=self.quantity,
                hold=self.hold,
                substeps=steps,
                shift=key[1],
                skew=key[2],
                based=model.excitation == "base_acceleration",
                channels=tuple(sorted(channels | known)),
                integrator=self.integrator,
                whitening=self.whitening,
            )
        return self._prepared[key]
