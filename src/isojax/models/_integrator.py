"""How finely to integrate: the one place of steps and tolerances."""

import dataclasses

import diffrax
import equinox as eqx
from jaxtyping import Array, Float

from .._show import shown
from ._isolator import Isolator
from ._rk4 import RK4

_FINE_STEPS = 4
"""Steps a sample of a table that is interpolated: eight parts, as fine as that of a `Sampled` drive."""


@shown
class Integrator(eqx.Module):
    """Solver, steps and tolerances; every derived tolerance follows from these.

    Attributes:
        solver: a diffrax solver. `RK4` steps records from sample to sample, without diffrax's own loop; any
            other simulates them through `diffrax.diffeqsolve`.
        substeps: fixed steps a sample at least; elements with sharp laws raise it (see `steps_per_sample`).
        rtol: relative tolerance of adaptive steps, or None for fixed steps.
        atol: absolute tolerance of adaptive steps on the state in SI units, used where `rtol` is given.
        max_steps: steps after which one simulation gives up.
        steps_per_period: steps a drive period of period maps; elements with sharp laws multiply it. Maps over
            a grid use it as it is and report their error; a single orbit takes as many as its tolerance
            needs.
        band_limited: whether a jump of the reading between two samples rings in these, as behind an
            anti-aliasing filter, or each sample is the reading at its instant. A fit finds out which.

    Raises:
        ValueError: if `rtol` is given to a solver that estimates no error, or the steps a period are odd.

    Example:
        >>> ij.Integrator().with_steps(256).steps_per_period
        256
    """

    solver: diffrax.AbstractSolver = eqx.field(default_factory=RK4)
    substeps: int = eqx.field(static=True, default=1)
    rtol: float | None = eqx.field(static=True, default=None)
    atol: float = eqx.field(static=True, default=1e-12)
    max_steps: int = eqx.field(static=True, default=50_000_000)
    steps_per_period: int = eqx.field(static=True, default=128)
    band_limited: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        """Refuse adaptive steps without an error estimate."""
        if self.rtol is not None and not isinstance(self.solver, diffrax.AbstractAdaptiveSolver):
            raise ValueError(
                "Argument `solver` must estimate its error where `rtol` is given, such as diffrax.Dopri8(), "
                f"but is {type(self.solver).__name__}()."
            )
        if self.steps_per_period < 8 or self.steps_per_period % 2:
            raise ValueError(
                f"Argument `steps_per_period` must be even and at least 8, but is {self.steps_per_period}."
            )

    def steps_per_sample(self, model: Isolator) -> int:
        """Give the integration steps a sample.

        Args:
            model: the isolator, whose sharpest element may ask for more.

        Returns:
            The larger of the two demands.
        """
        return max(self.substeps, model.substeps)

    def record_steps(self, model: Isolator) -> int:
        """Give the integration steps a sample of records, which are split where a law jumps or bends.

        Args:
            model: the isolator.

        Returns:
            As `steps_per_sample`, but a law that is split asks for no more than one.
        """
        return max(self.substeps, *(one.substeps for one in model.elements if not one.splits), 1)

    @property
    def is_locked(self) -> bool:
        """Whether records are stepped by RK4 from sample to sample, under one scan without diffrax's loop."""
        return isinstance(self.solver, RK4)

    def words(self, model: Isolator) -> str:
        """Say how records of a model are integrated.

        Args:
            model: the isolator.

        Returns:
            Such as "RK4, 1 a sample" or "Dopri8 of diffrax, rtol 1e-08, atol 1e-12".
        """
        name = type(self.solver).__name__
        if self.is_locked:
            return f"{name}, {self.record_steps(model)} a sample"
        if self.rtol is None:
            return f"{name} of diffrax, {self.steps_per_sample(model)} a sample"
        return f"{name} of diffrax, rtol {self.rtol:g}, atol {self.atol:g}"

    def table_steps(self, model: Isolator) -> int:
        """Give the steps a sample, of two parts each, into which a record's drive is tabulated.

        Args:
            model: the isolator.

        Returns:
            Those of RK4; for any other solver enough to interpolate the table between them.
        """
        if self.is_locked:
            return self.record_steps(model)
        return max(_FINE_STEPS, self.steps_per_sample(model))

    def steps_a_period(self, model: Isolator) -> int:
        """Give the integration steps a drive period, which are split where a law jumps or bends.

        Args:
            model: the isolator, whose sharpest element may ask for more; one that is split does not.

        Returns:
            Steps, an even number.
        """
        return self.steps_per_period * max(
            (one.substeps for one in model.elements if not one.splits), default=1
        )

    def with_steps(self, steps_per_period: int) -> "Integrator":
        """Give the same integrator with other steps a period.

        Args:
            steps_per_period: even, at least 8.

        Returns:
            The integrator.
        """
        return dataclasses.replace(self, steps_per_period=steps_per_period)

    @property
    def orbit_tolerance(self) -> float:
        """Largest relative closing error of a periodic orbit that counts as found."""
        return 1e-10

    @property
    def residual_tolerance(self) -> float:
        """Largest residual of the equations of an orbit or a bifurcation that counts as solved."""
        return 1e3 * self.orbit_tolerance

    @property
    def multiplier_tolerance(self) -> float:
        """Integration error of the multipliers of a single orbit to which it is refined."""
        return 1e-11

    @property
    def orbit_error(self) -> float:
        """Integration error of the multipliers of a single orbit beyond which it is not accurate enough."""
        return 1e-9

    @property
    def map_error(self) -> float:
        """Error of a map's multipliers to which its steps are chosen, where none are asked for."""
        return 2e-5

    @property
    def map_orbit_tolerance(self) -> float:
        """Integration error to which steps are refined in cells of a map that are found as single orbits."""
        return 1e-3 * self.map_error

    @property
    def map_orbit_error(self) -> float:
        """Integration error of such a cell beyond which it is not accurate enough."""
        return 0.05 * self.map_error

    @property
    def map_tolerance(self) -> float:
        """Largest relative step of Newton's method after which a cell of a map needs no other.

        The multipliers belong to the state before the last step, so this is the size of their error; the
        error of the orbit itself is of the order of its square.
        """
        return 0.5 * self.map_error

    def controller(
        self,
        times: Float[Array, " time"],
        shortest: Float[Array, ""],
        jumps: Float[Array, " jump"] | None = None,
    ) -> diffrax.AbstractStepSizeController:
        """Give diffrax's step size controller.

        Args:
            times: ends of the fixed steps.
            shortest: adaptive step below which the integration gives up.
            jumps: times at which the equation of motion jumps: an adaptive step ends before and starts again
                after.

        Returns:
            A controller that steps from one of these times to the next, or an adaptive one where `rtol` is
            given.
        """
        if self.rtol is None:
            return diffrax.StepTo(ts=times)
        adaptive = diffrax.PIDController(rtol=self.rtol, atol=self.atol, dtmin=shortest, force_dtmin=False)
        return adaptive if jumps is None else diffrax.ClipStepSizeController(adaptive, jump_ts=jumps)
