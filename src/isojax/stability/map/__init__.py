"""Stability over a whole plane of drive amplitude and frequency.

In: an isolator, drive amplitudes and frequencies. Out: `StabilityMap`, one orbit with its multipliers in
every cell. Read _surface (orbits over displacement, where they do not fold, on _grids of _nodes through
which _spline lays splines), _shared_kinks, _starts (which orbit of the surface a force holds), _reader
(multipliers read off the surface), _batched_newton (those that cannot be, all at once; _map_method integrates
them), _single_orbits (those of sharp laws; _states_at_zero gives their starts), _map_error (a sample of cells
against finer steps), _sought (which orbits are found by which), _chunks (long maps, kept on disk), and _map,
which calls them and gives what _stability_map describes; then _chance (chances of cells, along
_orbit_curves), _found_again (the cells of a known map for another model, in pure JAX) and _read_slopes
(derivatives of cells read off tables of _node_slopes).
"""

from ._chance import chance_words as chance_words
from ._found_again import FoundCells as FoundCells
from ._found_again import cells_again as cells_again
from ._found_again import found_again as found_again
from ._found_again import found_together as found_together
from ._map import stability_map as stability_map
from ._map_method import Lane as Lane
from ._map_method import MapMethod as MapMethod
from ._node_slopes import Directions as Directions
from ._read_slopes import CellSlopes as CellSlopes
from ._read_slopes import SlopeTables as SlopeTables
from ._read_slopes import fewest_nodes as fewest_nodes
from ._read_slopes import multiplier_slopes as multiplier_slopes
from ._read_slopes import relative_error as relative_error
from ._stability_map import StabilityMap as StabilityMap
from ._stability_map import elsewhere_words as elsewhere_words
from ._stability_map import incomplete_words as incomplete_words
from ._stability_map import unconfirmed_words as unconfirmed_words
from ._states_at_zero import states_at_zero as states_at_zero
from ._surface import MapWindow as MapWindow
from ._window_steps import window_integrator as window_integrator
