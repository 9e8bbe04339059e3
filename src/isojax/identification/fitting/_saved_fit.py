"""Fits on disk: JSON, with everything but the measurements and what is computed from them."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._results import RESULTS, name_of_result, result_named
from ..._show import Row, shown
from ...models import Isolator, NormalMixture, model_from_dict, model_to_dict, read_json, write_whole
from ...records import Colour, NoiseEstimate
from ._coefficients import Coefficient, Coefficients
from ._errors import Errors

if TYPE_CHECKING:
    import pandas as pd

FORMAT = "isojax-fit"


@shown
class Statistics(NamedTuple):
    """Counts and criteria of a fit. Of one that failed chi2, criteria and scatters are NaN.

    Attributes:
        samples: samples that count, filtered noise counted by its independent samples.
        coefficients: free coefficients.
        chi2: squared whitened residual after the nuisances.
        dof: samples less nuisances less coefficients.
        aic: Akaike's criterion, chi2 + 2 coefficients.
        bic: Schwarz's criterion, chi2 + coefficients ln(samples).
        steps: simulations with derivatives that the search took.
        stiffness_scatter: standard deviation of the linear stiffness between records [relative].
        segment_scatter: the same between the segments of a record; 0 where no repeat shows one.
        integration_error: rms change of the readings when the integration steps are halved, over the noise;
            NaN where the steps were given.
        next_stiffness_scatter: standard deviation of the linear stiffness of a further record, over all
            scatters that the records allow [relative]; NaN where a single record shows none, where there is
            no linear spring, and in a file of before it was saved.
    """

    samples: int
    coefficients: int
    chi2: float
    dof: float
    aic: float
    bic: float
    steps: int
    stiffness_scatter: float
    segment_scatter: float
    integration_error: float
    next_stiffness_scatter: float = math.nan


@shown
class SavedFit(NamedTuple):
    """What of a fit stands in a file: its numbers, without the measurements.

    Attributes:
        title: of the campaign.
        model: the fitted isolator.
        start: the isolator that the search started from.
        free: names of the fitted coefficients.
        parameters: the coefficients with standard error, unit and start, by name or symbol.
        covariance: of the fitted coefficients [product of their units]; max(1, chi2/dof) enlarges it.
        stats: counts and criteria.
        noise: the noise that errors are compared with.
        errors: by role, "fit" and "holdout" (None without such records).
        result: how the search ended.
        mixture: law of the coefficients' deviations where its tails are longer than normal ones; None also in
            a file of before it was saved.
        tested_conditions: lowest and highest value of each operating condition that every fitted record
            states [SI].
    """

    title: str
    model: Isolator
    start: Isolator
    free: tuple[str, ...]
    parameters: Coefficients
    covariance: Float[np.ndarray, "parameter parameter"]
    stats: Statistics
    noise: NoiseEstimate
    errors: dict[str, Errors | None]
    result: RESULTS
    mixture: NormalMixture | None = None
    tested_conditions: Mapping[str, tuple[float, float]] = MappingProxyType({})

    def to_dict(self) -> dict[str, Any]:
        """Give the fit as plain numbers, words, lists and dictionaries; None where a number is not finite."""
        return _plain(
            {
                "format": FORMAT,
                "version": 1,
                "campaign": self.title,
                "result": name_of_result(self.result),
                "model": model_to_dict(self.model),
                "start": model_to_dict(self.start),
                "free": list(self.free),
                "parameters": self.parameters.to_dict(),
                "covariance": self.covariance.tolist(),
                "mixture": None if self.mixture is None else self.mixture.to_dict(),
                "tested_conditions": dict(self.tested_conditions),
                "statistics": self.stats._asdict(),
                "noise": {name: getattr(self.noise, name) for name in self.noise.__dataclass_fields__},
                "errors": {
                    role: None if errors is None else errors._asdict() for role, errors in self.errors.items()
                },
            }
        )

    def to_dataframe(self) -> "pd.DataFrame":
        """Give the coefficients as a table: a row each, by full name."""
        return to_dataframe(self.parameters)

    def save(self, path: str | Path) -> None:
        """Write the file again; see `Fit.save`."""
        save_fit(self, path)

    def _headline(self) -> str:
        return f"{self.title}, {fit_words(self.stats, self.parameters, self.result)}"

    def _rows(self) -> list[Row]:
        return self.parameters._rows()


def fit_words(stats: Statistics, parameters: Coefficients, result: RESULTS) -> str:
    """Give goodness, counts and outcome of a fit in one sentence."""
    if name_of_result(result) != "successful":
        return f"failed. {RESULTS[result]}"
    count = sum(one.fitted for one in parameters.entries)
    return f"χ²/dof {stats.chi2 / stats.dof:.4g} with {count} coefficients on {stats.samples} samples"


def to_dataframe(parameters: Coefficients) -> "pd.DataFrame":
    """Give coefficients as a table.

    Args:
        parameters: the coefficients.

    Returns:
        Symbol, value, standard error, unit, start and whether it was fitted; a row each, by full name.
    """
    # It takes half a second to import, which who asks for no table need not wait for.
    import pandas as pd

    return pd.DataFrame.from_dict(parameters.to_dict(), orient="index").rename_axis("name")


def save_fit(fit: SavedFit, path: str | Path) -> None:
    """Write a fit, whole or not at all.

    Args:
        fit: the fit.
        path: the file; its folder must exist.

    Raises:
        ValueError: if a number of the model is not finite.
    """
    for entry in fit.model.parameters:
        if not math.isfinite(entry.value):
            raise ValueError(f"The model of the fit must be finite, but its {entry.name} is {entry.value}.")
    write_whole(Path(path), json.dumps(fit.to_dict(), indent=1, allow_nan=False) + "\n")


def load_fit(path: str | Path) -> SavedFit:
    """Load a fit saved by `fit.save`.

    Model, start, coefficients, covariance, statistics, noise and errors are as they were saved. The campaign,
    the residuals and the equations of the search are not in the file: to diagnose or extend the model, read
    the campaign and fit again from `.model`.

    Args:
        path: the JSON file.

    Returns:
        The numbers of the fit.

    Raises:
        ValueError: if the file is missing or is no fit that isojax saved.
        RuntimeError: if JAX is not in 64-bit mode.

    Example:
        With the fit of `fit`'s example:

        >>> fitted.save("fit.json")
        >>> loaded = ij.load_fit("fit.json")
        >>> loaded.parameters["k1"] == fitted.parameters["k1"]
        True
    """
    path = Path(path)
    content = read_json(path)
    if not isinstance(content, dict) or content.get("format") != FORMAT or content.get("version") != 1:
        raise ValueError(f'{path}: must hold "format": "{FORMAT}", "version": 1, but does not.')

    def errors_of(one: dict[str, Any] | None) -> Errors | None:
        return None if one is None else Errors(**_numbers(one))

    try:
        saved = dict(content["noise"])
        colour = saved.pop("colour")
        noise = {key: tuple(one) if isinstance(one, list) else one for key, one in saved.items()}
        return SavedFit(
            content["campaign"],
            model_from_dict(content["model"], path),
            model_from_dict(content["start"], path),
            tuple(content["free"]),
            Coefficients(
                tuple(Coefficient(name, **_numbers(one)) for name, one in content["parameters"].items())
            ),
            np.array(content["covariance"], dtype=float).reshape((len(content["free"]),) * 2),
            Statistics(**_numbers(content["statistics"])),
            NoiseEstimate(**_numbers(noise), colour=_colour(colour)),
            {
                role: None if one is None else Errors(**_numbers(one))
                for role, one in content["errors"].items()
            },
            result_named(content["result"]),
            _mixture(content.get("mixture")),
            {name: (low, high) for name, (low, high) in content.get("tested_conditions", {}).items()},
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{path}: is no fit as isojax saves it ({error!r}).") from None


def _plain(value: Any) -> Any:
    """Give what JSON holds."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


def _colour(saved: list[Any] | None) -> Colour | None:
    """Give the law of coloured noise again."""
    if saved is None:
        return None
    colour = Colour(*saved)
    return colour._replace(law=tuple(colour.law), whitening=tuple(colour.whitening))


def _mixture(saved: dict[str, Any] | None) -> NormalMixture | None:
    """Give the law of the coefficients again."""
    if saved is None:
        return None
    return NormalMixture(**{name: np.array(values, dtype=float) for name, values in saved.items()})


def _numbers(fields: dict[str, Any]) -> dict[str, Any]:
    """Give fields with NaN where the file holds null."""
    return {key: math.nan if value is None else value for key, value in fields.items()}
