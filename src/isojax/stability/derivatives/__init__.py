"""isojax.stability.sensitivity."""

from ._sensitivity import Sensitivity as Sensitivity
from ._sensitivity import sensitivity as sensitivity
