"""Posterior of the coefficients of a fit by NUTS, which takes nothing for linear or normal."""

import importlib
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._given_numbers import given_chance, given_count
from .._parameters import list_parameters, to_free, to_physical
from .._progress import Counted, silent
from .._results import RESULTS, is_successful
from .._show import Row, amount, shown
from .._types import check_float64
from ..identification import Coefficient, Fit, as_fit
from ..identification.fitting import Likelihood

_MIXED = 1.05
"""Ratio of Gelman and Rubin up to which chains count as one: the draws are then good for an interval."""


@shown
class Posterior(NamedTuple):
    """Draws of the coefficients from their posterior.

    Attributes:
        coefficients: the free ones, as fitted.
        draws: of them [their units].
        confidence: chance that an interval holds the truth.
        effective_draws: independent draws that tell the mean of each coefficient as well.
        r_hat: ratio of the spread of all chains to that within one; near 1 where the chains agree.
        divergent: draws whose path was cut, because the posterior bends too sharply there.
    """

    coefficients: tuple[Coefficient, ...]
    draws: Float[np.ndarray, "chain draw coefficient"]
    confidence: float
    effective_draws: Float[np.ndarray, " coefficient"]
    r_hat: Float[np.ndarray, " coefficient"]
    divergent: int

    @property
    def pooled(self) -> Float[np.ndarray, "draw coefficient"]:
        """The draws of all chains."""
        return self.draws.reshape(-1, self.draws.shape[-1])

    @property
    def mean(self) -> Float[np.ndarray, " coefficient"]:
        """Mean of each coefficient [its unit]."""
        return self.pooled.mean(axis=0)

    @property
    def standard_error(self) -> Float[np.ndarray, " coefficient"]:
        """Standard deviation of each [its unit]."""
        return self.pooled.std(axis=0, ddof=1)

    @property
    def covariance(self) -> Float[np.ndarray, "coefficient coefficient"]:
        """Covariance [product of their units]."""
        return np.atleast_2d(np.cov(self.pooled, rowvar=False))

    @property
    def interval(self) -> Float[np.ndarray, "2 coefficient"]:
        """Quantiles that leave equal chances on either side."""
        half = 0.5 * (1.0 - self.confidence)
        return np.quantile(self.pooled, [half, 1.0 - half], axis=0)

    def _headline(self) -> str:
        chains, count, _ = self.draws.shape
        return (
            f"{chains} chains of {count} draws by NUTS, {self.confidence:.0%} intervals, at least "
            f"{self.effective_draws.min():.0f} effective draws"
        )

    def _rows(self) -> list[Row]:
        numbers = zip(self.coefficients, self.mean, self.standard_error, *self.interval, strict=True)
        return [
            Row(
                one.name,
                amount(float(mean), one.unit, float(error)),
                f"{low:.5g} to {high:.5g} (× {error / one.standard_error:.2f})",
            )
            for one, mean, error, low, high in numbers
        ]

    def _lines(self) -> list[str]:
        lines = ["In brackets: the standard deviation over the standard error of the fit."]
        if not np.all(self.r_hat < _MIXED):
            worst = self.coefficients[int(np.argmax(self.r_hat))].name
            lines.append(
                f"The chains disagree (r_hat {np.max(self.r_hat):.3g} of {worst}): take more draws before "
                "you use these numbers."
            )
        if self.divergent:
            lines.append(
                f"{self.divergent} draws were cut short: the posterior bends sharply, and its tails may be "
                "missing."
            )
        return lines


def posterior(
    fit: object,
    *,
    draws: int = 500,
    warmup: int = 100,
    chains: int = 2,
    confidence: float = 0.95,
    seed: int = 0,
    progress: Callable[[str], None] = silent,
) -> Posterior:
    """Draw the coefficients of a fit from their posterior.

    The prior is flat within the bounds of each coefficient. The likelihood is that of the fit: the same
    noise, initial states and stiffness of each record eliminated alike, and the same sum over all scatters of
    the stiffness that the records allow. Each gradient is J'r of one simulation with its derivatives. What is
    sampled are the unbounded variables of the fit, in units of its error bars.

    The extra "bayes" installs NumPyro, which draws: `pip install "isojax[bayes]"`.

    Args:
        fit: a fit, or what ends with one: an extension, a closed loop.
        draws: of each chain, after its warm-up.
        warmup: draws of each chain that find the length of a step; the error bars of the fit give its shape.
        chains: started apart, one after the other; two at least, because one cannot show that it is lost.
        confidence: chance that an interval is to hold the truth.
        seed: of the draws.
        progress: receives a line a draw.

    Returns:
        The draws, with what tells whether they suffice.

    Raises:
        ImportError: if NumPyro is not installed.
        ValueError: if the fit failed, its data do not determine a coefficient, or `draws`, `warmup`,
            `chains` or `confidence` is out of range.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Hoffman & Gelman 2014, J. Mach. Learn. Res. 15:1593 (NUTS); Phan, Pradhan & Jankowiak 2019,
    arXiv:1912.11554 (NumPyro); Gelman et al. 2013, Bayesian Data Analysis, sec. 11.4 (r_hat, effective
    draws).

    Example:
        A small test on the simulated bench:

        >>> from isojax import rig
        >>> plant = rig.Plant((rig.LinearStiffness(8e5), rig.LinearDamping(2e3)))
        >>> plan = rig.SteppedSine((30.0,), (4.9, 5.2), 6, ("forward",))
        >>> laws = ("linear_stiffness", "linear_damping")
        >>> file = rig.write_campaign("small", plant, plan, 1, "small", rig.Bench(rate=250.0), declared=laws)
        >>> drawn = ij.posterior(ij.fit(file), draws=20, warmup=20)
        >>> drawn.draws.shape
        (2, 20, 2)
    """
    check_float64()
    numpyro = _numpyro()
    meant = as_fit(fit)
    confidence = given_chance("confidence", confidence)
    draws, warmup = given_count("draws", draws, least=10), given_count("warmup", warmup, least=10)
    chains, seed = given_count("chains", chains, least=2), given_count("seed", seed, least=0)
    if not is_successful(meant.result):
        raise ValueError(f"Argument `fit` must have succeeded, but it did not. {RESULTS[meant.result]}")
    own = tuple(meant.parameters[name] for name in meant.free)
    lost = [one.name for one in own if not np.isfinite(one.standard_error)]
    if lost:
        raise ValueError(
            "Argument `fit` must determine each free coefficient, but its data do not determine "
            f"{', '.join(lost)}."
        )
    target = _Target(meant)
    kernel = numpyro.infer.NUTS(potential_fn=lambda z: -target.log_density(z), adapt_mass_matrix=False)
    advance = jax.jit(lambda state: kernel.sample(state, (), {}))
    points = np.empty((chains, draws, len(own)))
    total, cut = chains * (warmup + draws), 0
    for chain, key in enumerate(jax.random.split(jax.random.key(seed), chains)):
        here, there = jax.random.split(key)
        start = jax.random.normal(there, (len(own),))
        state = kernel.init(here, warmup, start, (), {})
        for draw in range(-warmup, draws):
            state = advance(state)
            done = chain * (warmup + draws) + draw + warmup + 1
            progress(Counted(f"{done} of {total} draws", done / total))
            if draw >= 0:
                points[chain, draw] = state.z
                cut += int(state.diverging)
    found = np.asarray(jax.vmap(jax.vmap(target.coefficients))(jnp.asarray(points)))
    return Posterior(
        own,
        found,
        confidence,
        np.asarray(numpyro.diagnostics.effective_sample_size(found)),
        np.asarray(numpyro.diagnostics.split_gelman_rubin(found)),
        cut,
    )


def _numpyro() -> Any:
    """Give NumPyro, or say how to install it."""
    try:
        importlib.import_module("numpyro.infer")
        return importlib.import_module("numpyro")
    except ImportError as error:
        raise ImportError(
            "A posterior needs the package NumPyro, which the extra `bayes` installs: "
            'python -m pip install "isojax[bayes]"'
        ) from error


class _Target:
    """The posterior as a sampler sees it: a density of independent variables of order one."""

    def __init__(self, fit: Fit):
        """Take the likelihood, and shape the variables by the error bars of the fit."""
        listed = list_parameters(fit.model)
        entries = [listed[place] for place in fit.estimate.places]
        self._specs = tuple(entry.spec for entry in entries)
        # The fit's own unit of an unbounded variable; beside a bound the error bar is the natural one.
        errors = fit.estimate.uncertainty.standard_error
        self._scales = np.maximum(np.abs([float(entry.value) for entry in entries]), errors)
        numbers = zip(entries, self._scales, strict=True)
        self._centre = jnp.array([to_free(entry.value, entry.spec, scale) for entry, scale in numbers])
        slopes = jax.jvp(self._physical, (self._centre,), (jnp.ones_like(self._centre),))[1]
        root = np.linalg.cholesky(fit.estimate.uncertainty.correlation)
        self._root = jnp.asarray((errors / np.asarray(slopes))[:, None] * root)
        self._likelihood = _differentiable(Likelihood(fit.estimate), len(entries))

    def _physical(self, free: Float[Array, " coefficient"]) -> Float[Array, " coefficient"]:
        each = zip(free, self._specs, self._scales, strict=True)
        return jnp.stack([to_physical(value, spec, scale) for value, spec, scale in each])

    def coefficients(self, z: Float[Array, " coefficient"]) -> Float[Array, " coefficient"]:
        """Give the coefficients of a point."""
        return self._physical(self._centre + self._root @ z)

    def log_density(self, z: Float[Array, " coefficient"]) -> Float[Array, ""]:
        """Give the logarithm of the density of a point: flat in the coefficients, so their slopes count."""
        free = self._centre + self._root @ z
        values, slopes = jax.jvp(self._physical, (free,), (jnp.ones_like(free),))
        return self._likelihood(values) + jnp.sum(jnp.log(jnp.abs(slopes)))


def _differentiable(likelihood: Likelihood, count: int) -> Callable[[Array], Array]:
    """Give the likelihood as a function that JAX compiles and differentiates once, forward or backward.

    The simulator shares its work out over cores by itself and differentiates forward only, so JAX asks it as
    it is, for value and gradient together.
    """
    shapes = jax.ShapeDtypeStruct((), float), jax.ShapeDtypeStruct((count,), float)

    def asked(values: Array) -> tuple[np.ndarray, np.ndarray]:
        value, slope = likelihood(np.asarray(values))
        return np.asarray(value), slope

    def both(values: Array) -> tuple[Array, Array]:
        return jax.pure_callback(asked, shapes, values, vmap_method="sequential")

    @jax.custom_jvp
    def density(values: Array) -> Array:
        return both(values)[0]

    @density.defjvp
    def _(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
        value, slope = both(*primals)
        return value, slope @ tangents[0]

    return density
