"""Springs and dampers that follow the pressure in the chamber, and tests at a pressure."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, no_type_check

from ._law import Law
from ._plan import Plan, Trial
from ._shaker import Shaker


@dataclass(frozen=True)
class AtPressure(Plan):
    """A plan carried out at one pressure in the chamber.

    Args:
        plan: what to test.
        pressure: absolute, Pa.
    """

    plan: Plan
    pressure: float

    def trials(self, shaker: Shaker, seed: int) -> tuple[Trial, ...]:
        """The trials of the plan; their names begin with the pressure."""
        return tuple(
            replace(trial, name=f"{1e-3 * self.pressure:g}kPa_{trial.name}", pressure=self.pressure)
            for trial in self.plan.trials(shaker, seed)
        )


@dataclass(frozen=True)
class _FollowsPressure(Law):
    """What is common to coefficients that change with a power of the pressure.

    Args:
        change: of the coefficient from the reference to twice it where the power is one, SI.
        reference: pressure at which the coefficient is that of the plain law, Pa.
        power: of the pressure.
    """

    change: float
    reference: float
    power: float = 1.0
    _share: float | None = field(default=None, repr=False)

    @no_type_check
    def placed(self, stretch, draw):
        """The law at the pressure of one record."""
        if stretch.pressure is None:
            raise ValueError(f"A plan must be `AtPressure` for a {type(self).__name__} to act.")
        return replace(self, _share=(stretch.pressure / self.reference) ** self.power - 1.0)

    @property
    def coefficient(self) -> float:
        """What the pressure of the record adds to the coefficient, SI.

        Raises:
            ValueError: if it is not known which record that is.
        """
        if self._share is None:
            raise ValueError(
                f"A {type(self).__name__} must be placed in a test before it acts; `rig.run` does that."
            )
        return self.change * self._share


@dataclass(frozen=True)
class PressureStiffness(_FollowsPressure):
    """f = change ((p/reference)^power - 1) x, with change in N/m."""

    name: ClassVar[str] = "pressure_stiffness"

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * x


@dataclass(frozen=True)
class PressureDamping(_FollowsPressure):
    """f = change ((p/reference)^power - 1) v, with change in N s/m."""

    name: ClassVar[str] = "pressure_damping"

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * v


@dataclass(frozen=True)
class PressureCubicStiffness(_FollowsPressure):
    """f = change ((p/reference)^power - 1) x^3, with change in N/m^3."""

    name: ClassVar[str] = "pressure_cubic_stiffness"

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * x * x * x
