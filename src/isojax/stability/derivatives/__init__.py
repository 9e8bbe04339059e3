"""Exact derivatives of orbits, maps, special points and functions by every coefficient.

In: a result of the other rooms, or a function of a model; a covariance if error bars are wanted. Out:
`Sensitivity`. Read _parameter_values (names and numbers), _subjects (one protocol for all that can be
differentiated), _map_derivatives with _smoothness (every cell of a map), and _sensitivity.
"""

from ._sensitivity import Sensitivity as Sensitivity
from ._sensitivity import sensitivity as sensitivity
