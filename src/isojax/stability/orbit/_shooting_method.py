"""How the orbits of a branch are closed: over how many drive periods, and by which steps."""

import equinox as eqx

from ...models import Integrator


class ShootingMethod(eqx.Module):
    """Shooting over some drive periods, or over half of one for the symmetric orbits of an odd model.

    Attributes:
        integrator: steps and solver.
        periods: drive periods after which the orbits repeat.
        half: whether they are closed with the half-period map.
    """

    integrator: Integrator
    periods: int = eqx.field(static=True)
    half: bool = eqx.field(static=True)

    @property
    def turns(self) -> float:
        """Drive periods of the map; 0.5 for minus the state half a period later."""
        return 0.5 if self.half else float(self.periods)
