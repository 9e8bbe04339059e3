"""The likelihood of the coefficients of a fit, as a function of them."""

import numpy as np
from jaxtyping import Float

from ..._parameters import list_parameters, replace_parameters
from ._elimination import step_nuisances
from ._estimate import Estimate
from ._problem import one_hot
from ._scatter_mixture import log_likelihood


class Likelihood:
    """Logarithm of the likelihood of the free coefficients, and its gradient, by one simulation each.

    Noise, initial states and the scatter of the stiffness count as in the error bars of the fit: the squared
    noise is that of the fit times max(1, chi2/dof), and all scatters that the records allow are summed over.
    The nuisances at other coefficients are those that the equations at the solution imply, so that the
    likelihood depends on nothing that was asked before.
    """

    def __init__(self, found: Estimate):
        """Take the equations at the solution, a column for each free coefficient in its standard errors."""
        self._found = found
        self._values = np.array([float(list_parameters(found.model)[place].value) for place in found.places])
        self._sizes = found.uncertainty.standard_error
        directions = one_hot(found.model, found.places, list(self._sizes))
        self._solution = found.simulator.evaluate(found.model, directions, found.point.nuisances)

    def __call__(
        self, values: Float[np.ndarray, " coefficient"]
    ) -> tuple[float, Float[np.ndarray, " coefficient"]]:
        """Give the logarithm of the likelihood and its gradient.

        Args:
            values: of the free coefficients [their units].

        Returns:
            Both, up to a constant; minus infinity and zeros where a simulation leaves every bound.
        """
        found, simulator = self._found, self._found.simulator
        numbers = [entry.value for entry in list_parameters(found.model)]
        for place, value in zip(found.places, values, strict=True):
            numbers[place] = value
        model = replace_parameters(found.model, numbers)
        owner = simulator.prepared(found.model, len(found.model.elements)).record
        step = (values - self._values) / self._sizes
        nuisances = step_nuisances(self._solution.reduced, owner, self._solution.nuisances, step)
        point = simulator.evaluate(model, one_hot(model, found.places, list(self._sizes)), nuisances)
        if not point.is_finite:
            return -np.inf, np.zeros_like(values)
        value, slope = log_likelihood(point.reduced, nuisances, found.inflation, found.shows_scatter)
        return value, slope / self._sizes
