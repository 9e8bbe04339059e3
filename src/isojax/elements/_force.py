"""The contract of what acts in the force balance: springs, dampers, friction, masses."""

from typing import ClassVar

from .._types import Internal, Lanes
from ._effect import AbstractEffect


class AbstractForce(AbstractEffect):
    """What acts in `mass x'' + sum of forces = F(t)`, the paper's eq. (4): a spring returns `+k x`.

    Attributes:
        substeps: integration steps a sample that the rounded law needs at least (sharp ones need several).
        slides: whether the law, unrounded, jumps with the sign of the velocity, so that it can hold the mass.
        active: whether the law may feed energy in, so that no check of passivity refuses it.
        proportional_to: the one thing that the force is proportional to: "displacement" for the linear
            spring, whose strength may differ from record to record, "velocity" for the linear damper; empty
            for every other law.
    """

    substeps: ClassVar[int] = 1
    slides: ClassVar[bool] = False
    active: ClassVar[bool] = False
    proportional_to: ClassVar[str] = ""

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        """Give the force on the left-hand side of the balance [N].

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.

        Returns:
            Force [N], positive when it opposes positive motion.
        """
        return 0.0 * x

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        """Give the rates of the internal states.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.

        Returns:
            One rate an internal state.
        """
        return tuple(0.0 * state for state in s)

    def inertia(self) -> Lanes | float:
        """Give the mass that moves with the isolator [kg]."""
        return 0.0

    def base_rate(self, a: Lanes, s: Internal) -> Internal:
        """Give what the acceleration of the base adds to the rates of the internal states.

        Under base excitation the coordinate moves with the base; a mass among the internal states, in that
        coordinate, feels the base as the isolated mass does.

        Args:
            a: acceleration of the base [m/s^2].
            s: internal states.

        Returns:
            One rate an internal state.
        """
        return tuple(0.0 * state for state in s)

    def unphysical_shape(self, displacement: float) -> str | None:
        """Say what makes the shape parameters no law of matter at an amplitude, if anything.

        The diagnosis checks the energy over a loop of every element with internal states; this is for
        degenerate shapes that take energy and yet describe no material.

        Args:
            displacement: largest displacement visited [m].

        Returns:
            The end of a sentence about the effect, or None.
        """
        return None

    def kinks(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        """Give the functions of the state at whose zeros the law is continuous but not smooth.

        A periodic orbit is split where one changes sign, so that each piece is smooth. An element that
        declares any overrides `force_beside` and `state_rate_beside` where the side matters.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.

        Returns:
            One value a kink, such as `x` for |x|x.
        """
        return ()

    def force_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Lanes:
        """Give the force with the law of one side of each kink, carried on smoothly past it.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.
            sides: +1 or -1, the sign of each of `kinks` on the side that is meant.

        Returns:
            Force [N]; equal to `force` where the state lies on those sides.
        """
        return self.force(x, v, s)

    def state_rate_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Internal:
        """Give the rates of the internal states with the law of one side of each kink; see `force_beside`.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.
            sides: +1 or -1, the sign of each of `kinks` on the side that is meant.

        Returns:
            One rate an internal state; equal to `state_rate` where the state lies on those sides.
        """
        return self.state_rate(x, v, s)

    def corners(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        """Give the functions of the state at whose zeros the law, unrounded, has a corner.

        Simulated records, orbits and maps are split there, and where an element that `slides` changes
        direction, so that each piece has the law of `sharp_force`.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.

        Returns:
            One value a corner, such as `x - g` of a stop.
        """
        return ()

    def sharp_force(
        self, x: Lanes, v: Lanes, s: Internal, direction: Lanes, sides: tuple[Lanes, ...]
    ) -> Lanes:
        """Give the force of the law without its rounding, each piece carried on smoothly past its end.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.
            direction: +1 or -1, the sign of the velocity that is meant.
            sides: +1 or -1, the sign of each of `corners` on the side that is meant.

        Returns:
            Force [N].
        """
        return self.force(x, v, s)

    @property
    def splits(self) -> bool:
        """Whether simulated records, orbits and maps are split where this law, unrounded, jumps or bends."""
        return self.slides or type(self).corners is not AbstractForce.corners
