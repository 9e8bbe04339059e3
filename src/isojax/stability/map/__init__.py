"""Stability over a whole plane of drive amplitude and frequency.

In: an isolator, drive amplitudes and frequencies. Out: `StabilityMap`, one orbit with its multipliers in
every cell. Read _surface (orbits over displacement, where they do not fold, on grids of _nodes through which
_spline lays splines), _shared_kinks, _starts (which orbit of the surface a force holds), _reader (multipliers
read off the surface), _batched_newton (those that cannot be, all at once; _map_method integrates them),
_map_error (a sample of cells against finer steps), _sought (which orbits are found by which), _chunks (long
maps, kept on disk), and _map, which calls
them and gives what _stability_map describes; then _found_again (the cells of a known map for another
model, in pure JAX).
"""

from ._batched_newton import states_at_zero as states_at_zero
from ._chance import chance_words as chance_words
from ._found_again import found_again as found_again
from ._map import stability_map as stability_map
from ._map_method import Lane as Lane
from ._map_method import MapMethod as MapMethod
from ._stability_map import StabilityMap as StabilityMap
from ._stability_map import unconfirmed_words as unconfirmed_words
