"""What the identified isolator does: periodic orbits, their multipliers, maps, branches, bifurcations."""

from ._floquet import Floquet as Floquet
from ._orbit import Orbit as Orbit
from ._orbit import find_periodic_orbit as find_periodic_orbit
