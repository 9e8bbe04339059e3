"""Two-chamber air spring."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class DualChamber(AbstractElement):
    """Two air chambers joined by a line: relaxation that slows down as the flow in the line turns turbulent.

    `f = K p`, `p' = v - q`, with the flow q that the pressure drives, `p = tau q + o |q| q`, hence
    `q = 2 p / (tau + sqrt(tau^2 + 4 o |p|))`: laminar line and orifice in series. With o = 0 it is a Maxwell
    branch, whose place it takes. p is the difference of the chamber pressures as a displacement,
    `p = V1 dP / (kappa P0 A)`.

    With chambers V1 (loaded) and V2, `K = k_lo V2 / V1`, where `k_lo = kappa P0 A^2 / (V1 + V2)` is the
    stiffness with the line wide open; a line with `dP = R Q + S |Q| Q` has
    `tau = R V1 V2 / (kappa P0 (V1 + V2))` and `o = S A V1 V2^2 / (kappa P0 (V1 + V2)^2)`.

    Attributes:
        stiffness: K [N/m].
        time_constant: tau, of the laminar flow [s].
        orifice: o [s^2/m].

    Source: Pelz & Buttenbender 2004, ISMA; Moon & Lee 2010 and Nieto et al. 2008 for the orifice.
    """

    name: ClassVar[str] = "dual_chamber"
    words: ClassVar[str] = "two-chamber air spring (laminar line and orifice)"
    strength: ClassVar[str] = "stiffness"
    internal_states: ClassVar[int] = 1
    absorbs: ClassVar[tuple[str, ...]] = ("maxwell_branch",)
    group: ClassVar[Group] = "Relaxation and further masses"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("maxwell_branch",),
            "repeat at a third and at three times the level: an orifice slows the relaxation down as the "
            "flow rises, a Maxwell branch knows no level",
        ),
    )

    stiffness: Scalar = parameter(symbol="K", unit="N/m", lower=0.0)
    time_constant: Scalar = parameter(symbol="tau", unit="s", lower=0.0)
    orifice: Scalar = parameter(symbol="o", unit="s^2/m", lower=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "DualChamber":
        return cls(0.0, 0.5 / scales.angular_frequency, scales.displacement / scales.velocity**2)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[DualChamber, ...]":
        """See `AbstractElement.grid`: flow half to mostly turbulent, on both sides of the band."""
        laminar, turbulent = 1.0 / scales.angular_frequency, scales.displacement / scales.velocity**2
        pairs = ((0.1, 0.5), (0.1, 3.0), (0.5, 0.5), (0.5, 3.0), (2.0, 1.0))
        return tuple(cls(0.0, slow * laminar, rough * turbulent) for slow, rough in pairs)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement

    def volume_ratio(self, low_stiffness: float) -> Scalar:
        """Give V2 / V1, the second chamber over the loaded one.

        Args:
            low_stiffness: k_lo, stiffness of the gas with the line wide open [N/m].

        Returns:
            `K / k_lo` [1].
        """
        return self.stiffness / low_stiffness

    def flow_resistance(
        self, low_stiffness: float, pressure: float, loaded_volume: float, polytropic_exponent: float = 1.4
    ) -> Scalar:
        """Give the laminar flow resistance of the line.

        Args:
            low_stiffness: k_lo, stiffness of the gas with the line wide open [N/m].
            pressure: P0, absolute, at rest [Pa].
            loaded_volume: V1 [m^3].
            polytropic_exponent: kappa [1].

        Returns:
            `R = tau kappa P0 (V1 + V2) / (V1 V2)` [Pa s/m^3].
        """
        ratio = self.volume_ratio(low_stiffness)
        return self.time_constant * polytropic_exponent * pressure * (1.0 + ratio) / (ratio * loaded_volume)

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.stiffness * s[0]

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        return (v - self._flow(s[0], jnp.abs(s[0])),)

    def kinks(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        return (s[0],)

    def state_rate_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Internal:
        return (v - self._flow(s[0], sides[0] * s[0]),)

    def _flow(self, p: Lanes, size: Lanes) -> Lanes:
        # Past its kink the law has a branch point at p = -tau^2 / (4 o); the floor keeps trial states off it.
        root = jnp.sqrt(jnp.maximum(self.time_constant**2 + 4.0 * self.orifice * size, 1e-20))
        return 2.0 * p / (self.time_constant + root)
