"""Harmonics of the drive that the recorded one does not show."""

import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, AddedHarmonic, Channels, Group, Scales

_PARTS = tuple(f"drive_{part}_{order}" for order in (2, 3) for part in ("cosine", "sine"))


class DriveHarmonics(AbstractElement):
    """The force that acted holds a harmonic of the recorded one (recorded as commanded, a shaker that bends).

    `u + h A cos(n theta + phi)`, with A and theta the amplitude and phase of the drive `A cos(theta)`; the
    share h is the same at every level and frequency. Under `A sin(2 pi f t)` theta is `2 pi f t - pi/2`.
    Orbits, branches and maps take any order, and any number of these elements.

    Attributes:
        share: h, harmonic over fundamental [1].
        phase: phi [rad].
        order: n, an integer of at least 2; in a record 2 or 3 [1].

    Raises:
        ValueError: if the order is no integer of at least 2.

    Source: Tomlinson 1979 on the force distortion of shakers; Ewins 2000, sec. 3.
    """

    name: ClassVar[str] = "drive_harmonics"
    words: ClassVar[str] = "harmonics of the drive that its record lacks"
    strength: ClassVar[str] = "share"
    channels: ClassVar[tuple[str, ...]] = _PARTS
    group: ClassVar[Group] = "The drive and the floor"

    share: Scalar = parameter(symbol="h", unit="1", lower=0.0)
    phase: Scalar = parameter(symbol="phi", unit="rad")
    order: Scalar = parameter(symbol="n", unit="1", fitted=False)

    def __check_init__(self):
        """Refuse what is no harmonic."""
        known = eqx.is_array(self.order) and not isinstance(self.order, Tracer)
        if known and not np.all((np.asarray(self.order) >= 2.0) & (np.asarray(self.order) % 1.0 == 0.0)):
            raise ValueError(f"Argument `order` must be an integer of at least 2, but is {self.order}.")

    @classmethod
    def guess(cls, scales: Scales) -> "DriveHarmonics":
        return cls(0.0, 0.0, 3.0)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[DriveHarmonics, ...]":
        """See `AbstractElement.grid`: both orders, phases a third of a turn apart."""
        third = 2.0 * math.pi / 3.0
        return tuple(cls(0.0, phase, order) for order in (2.0, 3.0) for phase in (-third, 0.0, third))

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return 1.0

    def channel_drive(self, channels: Channels) -> Lanes | float:
        second, third = (
            jnp.cos(self.phase) * channels[f"drive_cosine_{order}"]
            - jnp.sin(self.phase) * channels[f"drive_sine_{order}"]
            for order in (2, 3)
        )
        return self.share * jnp.where(self.order == 2.0, second, third)

    def check_record(self) -> None:
        if float(self.order) not in (2.0, 3.0):
            raise ValueError(
                f"Harmonics of the drive in a record must have the order 2 or 3, but one has {self.order}. "
                "Orbits, maps and simulations take any order."
            )

    def harmonics(self) -> tuple[AddedHarmonic, ...]:
        # A count: no derivative means anything.
        order = jax.lax.stop_gradient(self.order)
        whole = (order >= 2.0) & (order == jnp.round(order))
        return (AddedHarmonic(order, jnp.where(whole, self.share, jnp.nan), self.phase),)
