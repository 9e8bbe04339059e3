"""Floquet multipliers of a periodic orbit: whether a small disturbance dies out."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..._show import number, shown


@shown
class Floquet(eqx.Module):
    """How a small disturbance of a periodic orbit grows over one drive period.

    Attributes:
        multipliers: eigenvalues of the monodromy matrix, in falling modulus.
        half_period_multipliers: those of the half-period map, whose squares are `multipliers`; NaN where the
            orbit is not symmetric. One at -1 breaks the symmetry.
        monodromy: the derivative of the state after one period by the state before; displacement, velocity
            and internal states in SI units.
    """

    multipliers: Complex[Array, "*cells multiplier"]
    half_period_multipliers: Complex[Array, "*cells multiplier"]
    monodromy: Float[Array, "*cells state state"]

    @property
    def spectral_radius(self) -> Float[Array, "*cells"]:
        """Largest modulus; the orbit is stable below one."""
        return modulus(self.multipliers[..., 0])

    @property
    def margin(self) -> Float[Array, "*cells"]:
        """Distance to instability, `1 - spectral_radius`; negative where unstable."""
        return 1.0 - self.spectral_radius

    @property
    def stable(self) -> Array:
        """Whether every disturbance dies out; False where no orbit was found."""
        return self.spectral_radius < 1.0

    def _headline(self) -> str:
        radius = np.abs(np.asarray(self.multipliers)[..., 0])
        if radius.ndim:
            return f"{int(np.sum(radius < 1.0))} of {radius.size} orbits stable"
        return f"{stable_words(radius)}, largest multiplier of modulus {number(float(radius))}"


def stable_words(radius: Float[np.ndarray, ""] | float) -> str:
    """Say what the largest modulus of the multipliers means.

    Args:
        radius: the modulus; NaN where no orbit was found.

    Returns:
        "stable", "unstable" or "not found".
    """
    return "stable" if radius < 1.0 else "unstable" if radius >= 1.0 else "not found"


def modulus(value: Complex[Array, "..."]) -> Float[Array, "..."]:
    """Give the modulus of complex numbers with a derivative that is finite everywhere but at zero.

    Args:
        value: any shape.

    Returns:
        The modulus; of a real number its magnitude.
    """
    real, imaginary = jnp.real(value), jnp.imag(value)
    square = real * real + imaginary * imaginary
    root = jnp.sqrt(jnp.where(square > 0.0, square, 1.0))
    return jnp.where(square > 0.0, root, square)


def pair_angle(values: Complex[Array, "*cells multiplier"]) -> Float[Array, "*cells"]:
    """Give the angle of the complex pair of multipliers that is nearest to the unit circle.

    Args:
        values: Floquet multipliers.

    Returns:
        From 0 to pi [rad]; 0 or pi of real multipliers.
    """
    off = jnp.abs(modulus(values) - 1.0) + jnp.where(jnp.imag(values) == 0.0, 10.0, 0.0)
    own = jnp.take_along_axis(values, jnp.argmin(off, axis=-1)[..., None], axis=-1)[..., 0]
    return jnp.abs(jnp.arctan2(jnp.imag(own), jnp.real(own)))


def multipliers(matrix: Float[Array, "*cells state state"]) -> Complex[Array, "*cells multiplier"]:
    """Give the eigenvalues of monodromy matrices in falling modulus.

    Two states in closed form from trace and determinant, so that they differentiate, batch and run on a GPU;
    more by the general eigenvalue routine.

    Args:
        matrix: the matrices.

    Returns:
        Eigenvalues; NaN where the matrix is not finite.
    """
    if matrix.shape[-1] == 2:
        half_trace = 0.5 * (matrix[..., 0, 0] + matrix[..., 1, 1])
        # Not trace^2/4 - det: that cancels where the multipliers nearly coincide.
        spread = (0.5 * (matrix[..., 0, 0] - matrix[..., 1, 1])) ** 2 + matrix[..., 0, 1] * matrix[..., 1, 0]
        size = jnp.sqrt(jnp.where(spread == 0.0, 1.0, jnp.abs(spread)))
        root = jnp.where(spread == 0.0, 0.0, size)
        real, imaginary = jnp.where(spread > 0.0, root, 0.0), jnp.where(spread < 0.0, root, 0.0)
        outward = jnp.where(half_trace < 0.0, -1.0, 1.0)
        first = jax.lax.complex(half_trace + outward * real, imaginary)
        return jnp.stack([first, jax.lax.complex(half_trace - outward * real, -imaginary)], axis=-1)
    finite = jnp.all(jnp.isfinite(matrix), axis=(-2, -1))
    values = jnp.linalg.eigvals(jnp.where(finite[..., None, None], matrix, jnp.eye(matrix.shape[-1])))
    order = jnp.argsort(-jnp.abs(values), axis=-1)
    ordered = jnp.take_along_axis(values, order, axis=-1)
    return jnp.where(finite[..., None], ordered, jnp.nan + 0j)


def margin_beside_folds(values: Complex[np.ndarray, "*cells multiplier"]) -> Float[np.ndarray, "*cells"]:
    """Give what vanishes where an orbit loses its stability otherwise than by a fold.

    Args:
        values: Floquet multipliers.

    Returns:
        The least of two products over the multipliers: of one plus each (a period doubling), and of one minus
        each pair's product (a pair on the unit circle). Positive where the orbit is stable.
    """
    first, second = np.triu_indices(values.shape[-1], 1)
    doubling = np.prod(1.0 + values, axis=-1).real
    pair = np.prod(1.0 - values[..., first] * values[..., second], axis=-1).real
    return np.minimum(doubling, pair)
