"""A scan of the coefficients around a design and all over their bounds, for one that is better."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from .._show import shown
from ._design_search import ALLOWED_MISS, FoundDesign, Task, stand
from ._design_space import NotFinite

_REACH = (0.005, 0.1)
"""Smallest and largest standard deviation of the points around a design, as a share of the range of each
coefficient; drawn evenly in its logarithm."""

_BETTER = 1e-5
"""Difference of the objective over its size, or of the largest miss, from which a point is better."""


@shown
class Scan(NamedTuple):
    """A design compared with other coefficients.

    Attributes:
        points: that were compared: half of them all over the bounds, half around the design.
        smaller: how many have a smaller objective; where the design misses its limits, a smaller miss.
        failed: how many gave no finite number.
        better: how many are better: a smaller objective with every limit kept, or a smaller miss.
        kept: whether the design keeps its limits, so that objectives were compared.
    """

    points: int
    smaller: int
    failed: int
    better: int
    kept: bool

    @property
    def words(self) -> str:
        """What was found, in words."""
        lost = f"; {self.failed} failed" if self.failed else ""
        if not self.kept:
            nearer = f"{self.better} break" if self.better else "none breaks"
            return f"scan of {self.points} points: {nearer} the constraints by less{lost}"
        what = f"{self.smaller} have a smaller objective" if self.smaller else "none has a smaller objective"
        kept = ", none of these keeps the limits" if self.smaller and not self.better else ""
        best = f", {self.better} of these keep the limits" if self.better else ""
        return f"scan of {self.points} points: {what}{kept}{best}{lost}"

    def _headline(self) -> str:
        return self.words


def scan_design(
    task: Task, found: FoundDesign, count: int, seed: int
) -> tuple[Scan, Float[np.ndarray, " coordinate"] | None]:
    """Compare a design with other coefficients.

    Args:
        task: objective and constraints.
        found: the design.
        count: of points; half of them are of a Sobol sequence, half are drawn around the design.
        seed: of both.

    Returns:
        The scan, and the best point that is better than the design; None where there is none.
    """
    size = found.at.size
    spread = qmc.Sobol(size, rng=seed).random(1 << max(0, (count // 2 - 1).bit_length()))[: count // 2]
    draw = np.random.default_rng(seed)
    lowest, highest = _REACH
    reach = lowest * (highest / lowest) ** draw.uniform(size=count - len(spread))
    drawn = found.at + reach[:, None] * draw.standard_normal((len(reach), size))
    smaller = failed = better = 0
    best, best_point = (found.objective if found.feasible else found.violation), None
    for at in np.concatenate([spread, np.clip(drawn, 0.0, 1.0)]):
        try:
            if found.feasible:
                value = float(task.objective.at(at, slopes=False).value[0])
                if not value < found.objective - _BETTER * task.size:
                    continue
                smaller += 1
                good = stand(task, at)[1] <= ALLOWED_MISS
            else:
                value = stand(task, at)[1]
                good = value < found.violation - _BETTER
                smaller += good
        except NotFinite:
            failed += 1
            continue
        better += good
        if good and value < best:
            best, best_point = value, at
    return Scan(count, smaller, failed, better, found.feasible), best_point
