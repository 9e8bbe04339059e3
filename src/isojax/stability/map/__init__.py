"""Stability over a whole plane of drive amplitude and frequency.

In: an isolator, drive amplitudes and frequencies. Out: `StabilityMap`, one orbit with its multipliers in
every cell. Read _surface (orbits over displacement, where they do not fold), _shared_kinks, _starts (which
orbit of the surface a force holds), _batched_newton (all cells at once), _chunks (long maps, kept on disk),
_map_error (how many steps it takes), and _map, which calls them in this order.
"""

from ._batched_newton import states_at_zero as states_at_zero
from ._map import StabilityMap as StabilityMap
from ._map import stability_map as stability_map
from ._map_method import Lane as Lane
from ._map_method import MapMethod as MapMethod
