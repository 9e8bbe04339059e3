"""isojax.stability.map."""

from ._batched_newton import Lane as Lane
from ._batched_newton import MapMethod as MapMethod
from ._batched_newton import states_at_zero as states_at_zero
from ._map import StabilityMap as StabilityMap
from ._map import stability_map as stability_map
