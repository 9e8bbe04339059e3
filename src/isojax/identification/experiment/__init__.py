"""isojax.identification.experiment."""

from ._find_separation import find_separating_experiment as find_separating_experiment
from ._find_separation import with_separating_experiment as with_separating_experiment
