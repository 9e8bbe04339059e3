"""What the identified isolator does: periodic orbits, their multipliers, maps, branches, bifurcations."""

from ._branch import Branch as Branch
from ._branch import BranchPoints as BranchPoints
from ._branch import SpecialPoint as SpecialPoint
from ._continuation import continue_branch as continue_branch
from ._floquet import Floquet as Floquet
from ._orbit import Orbit as Orbit
from ._orbit import find_periodic_orbit as find_periodic_orbit
from ._switching import switch_branch as switch_branch
