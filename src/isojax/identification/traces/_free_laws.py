"""Free force laws: powers of the motion, waves along the path, laws with an internal state.

They are elements, so that they are scored like any other, but the catalogue does not list them: a diagnosis
cannot name one.
"""

import abc
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp

from ..._parameters import parameter
from ..._types import Internal, Lanes, Scalar, as_float64
from ...elements import AbstractElement, Scales

_NEAR_REST = 1e-3
"""Share of the largest displacement within which |x| is rounded."""

_SLOW = 0.02
"""Share of the slowest motion's velocity within which |v| is rounded."""

_ROUND = 2.0
"""How sharply a slipping spring lets go."""


def _rounded(value: Lanes, width: Lanes | float) -> Lanes:
    return jnp.sqrt(value * value + width * width)


class Wording(NamedTuple):
    """How a free law is reported.

    Attributes:
        formula: such as "|x| v".
        words: what kind of force that is.
        factor: of the strength in newtons that gives the coefficient before the formula.
        unit: of that coefficient.
        rank: how complex a law it is; of laws that look alike the one of the lowest rank is named.
    """

    formula: str
    words: str
    factor: float
    unit: str
    rank: float


class AbstractFreeForce(AbstractElement):
    """A force law outside the catalogue."""

    @abc.abstractmethod
    def wording(self) -> Wording:
        """Give formula, words and unit."""


def _power_term(letter: str, power: float, odd: bool) -> str:
    """Give one factor of a power law: "x^3", "|x|^1.5", "|v|v", "sgn(x)"."""
    if power == 0.0:
        return f"sgn({letter})" if odd else ""
    whole = power == round(power)
    if whole and (power % 2 == 1) == odd:
        return letter if power == 1.0 else f"{letter}^{power:g}"
    if odd:
        lower = power - 1.0
        if lower < 0.0:
            return f"sgn({letter}) |{letter}|^{power:g}"
        return f"|{letter}|{letter}" if lower == 1.0 else f"|{letter}|^{lower:g} {letter}"
    return f"|{letter}|" if power == 1.0 else f"|{letter}|^{power:g}"


def _power_unit(power: float, speed_power: float) -> str:
    """Give the unit of a coefficient before |x|^p |v|^q."""
    metres = power + speed_power
    above = "" if speed_power == 0.0 else " s" if speed_power == 1.0 else f" s^{speed_power:g}"
    below = "" if metres == 0.0 else "/m" if metres == 1.0 else f"/m^{metres:g}"
    return f"N{above}{below}"


_KINDS = {
    (True, False): "a spring-like force (odd in x)",
    (False, True): "a damping-like force (odd in v)",
    (True, True): "a force odd in x and in v: it does work on either side of the centre, none over a cycle",
    (False, False): "a one-sided force (the same both ways)",
}


def _power_words(power: float, speed_power: float, odd: bool, speed_odd: bool) -> str:
    known = _KINDS[odd, speed_odd]
    if speed_odd and power > 0.0:
        return f"{known} that grows with the distance from the centre"
    if odd and speed_power > 0.0 and not speed_odd:
        return f"{known} that grows with the speed"
    if speed_odd and not odd and speed_power == 0.0:
        return f"{known}, of one size at every speed"
    return known


class PowerForce(AbstractFreeForce):
    """A power of displacement times a power of velocity, each with or without its sign.

    `A phi`, `phi = |x/X|^p |v/V|^q`, times sgn(x) if odd in x, times sgn(v) if odd in v.

    Attributes:
        size: A, the force at the largest motion [N].
        power: p.
        speed_power: q.
        odd: 1 where the force changes its sign with x, else 0.
        speed_odd: 1 where it changes its sign with v, else 0.
        displacement: X [m].
        velocity: V [m/s].
        slowest: smallest velocity amplitude [m/s].
    """

    name: ClassVar[str] = "power_force"
    words: ClassVar[str] = "a power of displacement and velocity"
    strength: ClassVar[str] = "size"
    signed: ClassVar[bool] = True

    size: Scalar = parameter(symbol="A", unit="N")
    power: Scalar = eqx.field(converter=as_float64, default=0.0)
    speed_power: Scalar = eqx.field(converter=as_float64, default=0.0)
    odd: Scalar = eqx.field(converter=as_float64, default=0.0)
    speed_odd: Scalar = eqx.field(converter=as_float64, default=0.0)
    displacement: Scalar = eqx.field(converter=as_float64, default=1.0)
    velocity: Scalar = eqx.field(converter=as_float64, default=1.0)
    slowest: Scalar = eqx.field(converter=as_float64, default=1.0)

    @classmethod
    def guess(cls, scales: Scales) -> "PowerForce":
        return cls(0.0, 0.0, 0.0, 0.0, 0.0, scales.displacement, scales.velocity, scales.slowest_velocity)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        far, fast = x / self.displacement, v / self.velocity
        width = _SLOW * self.slowest / self.velocity
        size, speed = _rounded(far, _NEAR_REST), _rounded(fast, width)
        side = jnp.where(self.odd != 0.0, far / size, 1.0)
        way = jnp.where(self.speed_odd != 0.0, fast / speed, 1.0)
        return self.size * side * way * size**self.power * speed**self.speed_power

    def wording(self) -> Wording:
        p, q = float(self.power), float(self.speed_power)
        odd, speed_odd = bool(self.odd != 0.0), bool(self.speed_odd != 0.0)
        factors = [one for one in (_power_term("x", p, odd), _power_term("v", q, speed_odd)) if one]
        formula = " ".join(factors) or "1"
        factor = 1.0 / float(self.displacement**p * self.velocity**q)
        halves = 10.0 * ((p % 1.0 > 0.0) + (q % 1.0 > 0.0))
        words = _power_words(p, q, odd, speed_odd) if factors else "a constant force"
        return Wording(formula, words, factor, _power_unit(p, q), p + q + halves)


class WaveForce(AbstractFreeForce):
    """A force that is periodic along the path.

    `A sin(x/l)` or `A cos(x/l)`.

    Attributes:
        size: A [N].
        length: l [m].
        phase: 0 for the sine, pi/2 for the cosine.
    """

    name: ClassVar[str] = "wave_force"
    words: ClassVar[str] = "a force that is periodic along the path"
    strength: ClassVar[str] = "size"
    signed: ClassVar[bool] = True

    size: Scalar = parameter(symbol="A", unit="N")
    length: Scalar = eqx.field(converter=as_float64, default=1.0)
    phase: Scalar = eqx.field(converter=as_float64, default=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "WaveForce":
        return cls(0.0, 0.3 * scales.displacement, 0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.size * jnp.sin(x / self.length + self.phase)

    def wording(self) -> Wording:
        law = "sin" if float(self.phase) == 0.0 else "cos"
        formula = f"{law}(x / {1e3 * float(self.length):.3g} mm)"
        return Wording(formula, "a force that is periodic along the path", 1.0, "N", 20.0)


class SlipForce(AbstractFreeForce):
    """A spring that slips: a rate-independent internal state.

    `A z/r`, `z' = v (1 - (z/r)^2)` while v drives z on, `z' = v` on the way back; sums of several r are the
    Prandtl-Ishlinskii operator.

    Attributes:
        size: A, the force at which it slips [N].
        reach: r [m].

    Source: Jenkins 1962; Ishlinskii 1944; Visintin 1994, sec. III.2.
    """

    name: ClassVar[str] = "slip_force"
    words: ClassVar[str] = "a spring that slips"
    strength: ClassVar[str] = "size"
    signed: ClassVar[bool] = True
    internal_states: ClassVar[int] = 1

    size: Scalar = parameter(symbol="A", unit="N")
    reach: Scalar = eqx.field(converter=as_float64, default=1.0)

    @classmethod
    def guess(cls, scales: Scales) -> "SlipForce":
        return cls(0.0, 0.2 * scales.displacement)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.size * s[0] / self.reach

    def wording(self) -> Wording:
        formula = f"slip(x; {1e3 * float(self.reach):.3g} mm)"
        return Wording(formula, "a spring that slips (internal state, rate-independent)", 1.0, "N", 30.0)

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        full = jnp.minimum(jnp.abs(s[0] / self.reach), 1.0) ** _ROUND
        return (v * jnp.where(v * s[0] > 0.0, 1.0 - full, 1.0),)


class FadingForce(AbstractFreeForce):
    """A fading internal state that follows the displacement, or a power of it.

    `A p`, `p' = d(sgn(x) |x/X|^n)/dt - p/tau`.

    Attributes:
        size: A [N].
        time_constant: tau [s].
        power: n.
        displacement: X [m].

    Source: Maxwell 1867; with n above 1 the nonlinear branches of Schapery 1969.
    """

    name: ClassVar[str] = "fading_force"
    words: ClassVar[str] = "a force that relaxes"
    strength: ClassVar[str] = "size"
    signed: ClassVar[bool] = True
    internal_states: ClassVar[int] = 1

    size: Scalar = parameter(symbol="A", unit="N")
    time_constant: Scalar = eqx.field(converter=as_float64, default=1.0)
    power: Scalar = eqx.field(converter=as_float64, default=1.0)
    displacement: Scalar = eqx.field(converter=as_float64, default=1.0)

    @classmethod
    def guess(cls, scales: Scales) -> "FadingForce":
        return cls(0.0, 1.0 / scales.angular_frequency, 1.0, scales.displacement)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.size * s[0]

    def wording(self) -> Wording:
        power = float(self.power)
        formula = f"fade({_power_term('x', power, True)}; {1e3 * float(self.time_constant):.3g} ms)"
        factor = float(self.displacement) ** -power
        return Wording(formula, "a force that relaxes", factor, _power_unit(power, 0.0), 30.0 + power)

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        size = _rounded(x / self.displacement, _NEAR_REST)
        rate = self.power * size ** (self.power - 1.0) * v / self.displacement
        return (rate - s[0] / self.time_constant,)


_ORDER = 4.0
_MIXED = ((0.5, 0.0), (1.5, 0.0), (2.5, 0.0), (0.5, 1.0), (1.5, 1.0))
_SLIP_REACHES = (0.1, 0.2, 0.4, 0.8)
_WAVES = (0.1, 0.15, 0.2, 0.3, 0.5)
_TIMES = (0.1, 0.3, 1.0, 3.0, 10.0)


def free_laws(scales: Scales) -> tuple[AbstractFreeForce, ...]:
    """Give the free force laws at zero strength.

    Args:
        scales: magnitudes of the records.

    Returns:
        Powers p and q of |x| and |v| up to p + q = 4 (5 alone), some with halves, each in the four parities;
        waves of several lengths; slipping springs of several reaches; relaxing forces of several times.
    """
    whole = [(float(p), float(q)) for p in range(5) for q in range(5) if p + q <= _ORDER]
    pairs = [*whole, (5.0, 0.0), (0.0, 5.0), *_MIXED, *((q, p) for p, q in _MIXED)]
    shapes = (scales.displacement, scales.velocity, scales.slowest_velocity)
    powers = tuple(
        PowerForce(0.0, p, q, odd, speed_odd, *shapes)
        for p, q in pairs
        for odd in (0.0, 1.0)
        for speed_odd in (0.0, 1.0)
    )
    waves = tuple(
        WaveForce(0.0, share * scales.displacement, phase)
        for share in _WAVES
        for phase in (0.0, 0.5 * jnp.pi)
    )
    slips = tuple(SlipForce(0.0, share * scales.displacement) for share in _SLIP_REACHES)
    fading = tuple(
        FadingForce(0.0, share / scales.angular_frequency, power, scales.displacement)
        for power in (1.0, 2.0, 3.0)
        for share in _TIMES
    )
    return (*powers, *waves, *slips, *fading)
