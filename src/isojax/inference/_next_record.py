"""The errors of a fit, enlarged by what is peculiar to each test: for answers about the next one."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .._given_numbers import given_number
from .._parameters import list_parameters
from .._results import RESULTS, is_successful
from .._show import Row, shown
from ..identification.fitting import Fit, Fitted, SavedFit, as_fit
from ..identification.jacobian import stiffness_place
from ..models import FitAt, Isolator, NormalMixture


@shown
class NextRecord(NamedTuple):
    """A fit with the errors of an answer about a further record; it goes wherever a fit goes as `fit=`.

    Attributes:
        model: the fitted isolator.
        free: names of the coefficients that are uncertain.
        covariance: of these [product of their units].
        result: how the search ended.
        scatter: standard deviation of the linear stiffness of a record [relative]; 0 without a linear spring.
        calibration: of the force of the next test [relative].
        mixture: law of the coefficients' deviations where its tails are longer than normal ones.
        tested_conditions: of the fit.
    """

    model: Isolator
    free: tuple[str, ...]
    covariance: Float[np.ndarray, "coefficient coefficient"]
    result: RESULTS
    scatter: float
    calibration: float
    mixture: NormalMixture | None = None
    tested_conditions: Mapping[str, tuple[float, float]] = MappingProxyType({})

    @property
    def words(self) -> str:
        """Whose errors these are, and what enlarges them."""
        return (
            f"of a further record: stiffness scatters by {100.0 * self.scatter:.2g} %, "
            f"force known to {100.0 * self.calibration:.2g} %"
        )

    def _headline(self) -> str:
        return self.words

    def _rows(self) -> list[Row]:
        errors = np.sqrt(np.diag(self.covariance))
        return [
            Row(name, f"{float(self.model[name]):.6g} ± {error:.2g}")
            for name, error in zip(self.free, errors, strict=True)
        ]


def next_record(fit: Fit | SavedFit | Fitted, *, calibration: float = 0.0) -> NextRecord:
    """Give a fit the errors of answers about a further record.

    The errors of a fit are those of its coefficients, which belong to the mean of all records. A further
    record has a linear stiffness of its own, which deviates as those of the fitted records do; how much they
    do is summed over, because few records show it badly. Its force may also be known no better than its
    calibration: a force that is wrong by a share acts as if the mass and every coefficient of a force were.

    Args:
        fit: a fit to two records or more, a saved one, or what ends with one: an extension, a closed loop.
        calibration: standard uncertainty of the force of the next test, against that of the fitted ones
            [relative].

    Returns:
        What `uncertainty`, `stability_map` and the curves take as `fit`.

    Raises:
        ValueError: if the fit failed, a single record shows no scatter of the stiffness, `calibration` is
            no share from 0 to below 1, or is given under base excitation.

    Source: Gelman et al. 2013, Bayesian Data Analysis, sec. 5.4 (prediction for a further group).

    Example:
        What a further test will show, with the fit, `amplitude` and `answer` of `uncertainty`'s example:

        >>> expected = ij.uncertainty(ij.next_record(fitted, calibration=0.005), amplitude)
        >>> bool(expected.standard_error > answer.standard_error)
        True
    """
    if isinstance(fit, FitAt):
        raise ValueError(
            "Argument `fit` must be a fit, but is one at an operating condition. Ask for the condition last: "
            "`fit_at(next_record(fit), ...)`."
        )
    held = fit if isinstance(fit, SavedFit) else as_fit(fit)
    if not is_successful(held.result):
        raise ValueError(f"Argument `fit` must have succeeded, but it did not. {RESULTS[held.result]}")
    calibration = given_number(
        "calibration", calibration, "be a share from 0 to below 1", lambda share: 0.0 <= share < 1.0
    )
    model, listed = held.model, list_parameters(held.model)
    if calibration and model.excitation != "force":
        raise ValueError(
            "Argument `calibration` is that of a force, but the model is driven through its base: an error "
            "of the base acceleration acts like one of the same share in `amplitude`."
        )
    values = np.array([float(entry.value) for entry in listed])
    stiffness = np.zeros(len(listed))
    spring, scatter = stiffness_place(model), 0.0
    if spring is not None:
        scatter = held.stats.next_stiffness_scatter
        if not np.isfinite(scatter):
            raise ValueError(
                "Argument `fit` must rest on two records or more: one shows no scatter of the stiffness "
                "between records. A file of an older version does not hold the scatter: fit again."
            )
        stiffness[spring] = values[spring]
    # A force in a unit that is off by a share: what is measured in newtons or kilograms follows it.
    scaled = np.array([entry.spec.unit.startswith(("N", "kg")) for entry in listed])
    common = np.where(scaled, calibration * values, 0.0)
    covariance = np.diag((scatter * stiffness) ** 2) + np.outer(common, common)
    names = [entry.name for entry in listed]
    fitted = np.array([names.index(name) for name in held.free])
    covariance[np.ix_(fitted, fitted)] += held.covariance
    uncertain = np.flatnonzero(np.diag(covariance) != 0.0)
    free = tuple(names[place] for place in uncertain)
    law = held.mixture
    if law is not None:
        alone = law.scatters[:, None] * stiffness
        changes = np.stack([alone, np.broadcast_to(common, alone.shape)], axis=1)
        law = law.propagated(np.eye(len(listed))[uncertain][:, fitted]).widened(changes[..., uncertain])
    errors = covariance[np.ix_(uncertain, uncertain)]
    return NextRecord(model, free, errors, held.result, scatter, calibration, law, held.tested_conditions)
