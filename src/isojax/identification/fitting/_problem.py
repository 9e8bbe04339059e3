"""Records cut into segments, and the equations of a model at one point."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._parameters import list_parameters
from ..._show import shown
from ...excitations import Hold
from ...models import Integrator, Isolator, Quantity
from ...records import Record
from ..jacobian import STIFFNESS_SCALE_UNIT, Segment
from ._elimination import Nuisances, Reduced


@shown
class Problem(NamedTuple):
    """Records cut into segments, and the noise against which errors are held.

    Attributes:
        records: the records.
        segments: pieces of them.
        quantity: what the sensor measures.
        hold: what the drive does between samples.
        noise: of each record, rms of white noise that has the density of the noise inside its band, or of
            what the whitening filter leaves [SI unit of the output].
        integrator: solver and steps.
        heads: the first samples of each record, where records are left whole and only these may set the
            initial states; empty where every segment settles its own.
        step_error: rms error of the integration over the noise of a sample.
        share: share of the samples of which the noise is independent; below 1 where a filter has limited it.
        whitening: coefficients of the filter that whitens coloured noise; none where it is white.
        thinned: measured samples that one sample of the records stands for.
    """

    records: tuple[Record, ...]
    segments: tuple[Segment, ...]
    quantity: Quantity
    hold: Hold
    noise: tuple[float, ...]
    integrator: Integrator
    heads: tuple[Segment, ...] = ()
    step_error: float = float("nan")
    share: float = 1.0
    whitening: tuple[float, ...] = ()
    thinned: int = 1

    @property
    def is_uncut(self) -> bool:
        """Whether each record is one segment from its first sample to its last."""
        ends = [(one.record, one.start, one.stop) for one in self.segments]
        return ends == [(place, 0, record.output.size) for place, record in enumerate(self.records)]


@shown
class Point(NamedTuple):
    """A model with the nuisances that belong to it, and the equations there.

    Attributes:
        model: the isolator.
        nuisances: where they stand.
        reduced: normal equations of the columns asked for.
        samples: independent samples that count in each record: N `share`, because noise that is white up to a
            filter's cut-off and nothing beyond leaves, weighed by its density, so much chi-square.
    """

    model: Isolator
    nuisances: Nuisances
    reduced: Reduced
    samples: Float[np.ndarray, " record"]

    @property
    def free_samples(self) -> float:
        """Independent samples less the degrees of freedom that the nuisances took."""
        return float(np.sum(self.samples - self.reduced.eliminated))

    @property
    def chi2(self) -> float:
        """Sum of squared whitened residuals after the nuisances, with their priors."""
        return float(self.reduced.matrix[-1, -1])

    @property
    def is_finite(self) -> bool:
        """Whether every segment's simulation stayed finite.

        A sum of squares below zero is the rounding of huge numbers that cancel: a simulation that diverged.
        """
        return bool(np.all(np.isfinite(self.reduced.matrix)) and self.chi2 >= 0.0)


def stiffness_deviation(nuisances: Nuisances) -> Float[np.ndarray, " record"]:
    """Give each record's relative deviation of the linear stiffness."""
    return nuisances.stiffness * STIFFNESS_SCALE_UNIT


def one_hot(
    model: Isolator, places: Sequence[int], sizes: Sequence[float]
) -> Float[np.ndarray, "parameter column"]:
    """Give directions along single parameters.

    Args:
        model: the isolator.
        places: parameters, by their place in `list_parameters`.
        sizes: size of one unit of change of each.

    Returns:
        One column a place.
    """
    directions = np.zeros((len(list_parameters(model)), len(places)))
    directions[list(places), range(len(places))] = sizes
    return directions
