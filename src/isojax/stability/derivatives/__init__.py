"""Exact derivatives of orbits, maps, special points and functions by every coefficient.

In: a result of the other rooms, or a function of a model; a covariance if error bars are wanted. Out:
`Sensitivity`. Read _parameter_values (names and numbers), _find_again (a known result for another model,
which JAX differentiates, batches and compiles), _subjects (one protocol for all that can be differentiated),
and _sensitivity.
"""

from ._find_again import find_again as find_again
from ._sensitivity import Sensitivity as Sensitivity
from ._sensitivity import sensitivity as sensitivity
