"""What the blind trial may hide in a campaign: one line an effect in `EFFECTS`.

Each line gives the law of the simulated rig in the terms of the catalogue element of the same name, random
shapes, the signs that are physical, the names that it may be given, and a cap: the largest strength that
leaves the motion a small change of the plant's own.
"""

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from isojax import elements, rig

Shape = dict[str, float]
Effect = rig.Law | rig.Instrument


@dataclass(frozen=True)
class Motion:
    """How the plant moves without the effect.

    Args:
        lowest: smallest force amplitude, N.
        displacement: largest amplitude, m.
        acceleration: largest amplitude, m/s^2.
        angular: middle of the band, rad/s.
        k1: linear stiffness, N/m.
        c1: linear damping, N s/m.
    """

    lowest: float
    displacement: float
    acceleration: float
    angular: float
    k1: float
    c1: float

    @property
    def velocity(self) -> float:
        """Largest amplitude of the velocity, m/s."""
        return self.displacement * self.angular


@dataclass(frozen=True)
class Hidden:
    """One kind of effect that may be hidden.

    Args:
        law: the rig's law of a strength and a shape, both in the terms of the catalogue element.
        most: largest strength.
        shape: draws the other coefficients of the element; what is left out is as the element guesses it.
        signed: whether a negative strength is drawn, too.
        fixed: the strength, where it cannot be chosen.
        exact: catalogue names of the same trace, this one included, where no data can part them.
        near: names that may stand first in its place, because they are its family, with reasons.
        known_by: names that it may come out under while it is no candidate, with reasons; `near` goes without
            saying.
    """

    law: Callable[[float, Shape], Effect]
    most: Callable[[Motion], float]
    shape: Callable[[np.random.Generator, Motion], Shape] = lambda draw, motion: {}
    signed: bool = False
    fixed: float | None = None
    exact: tuple[str, ...] = ()
    near: dict[str, str] = field(default_factory=dict)
    known_by: dict[str, str] = field(default_factory=dict)


def log_uniform(draw: np.random.Generator, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform."""
    return float(np.exp(draw.uniform(np.log(low), np.log(high))))


def _dahl_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    return {"presliding": motion.displacement * log_uniform(draw, 0.05, 1.0)}


def _lugre_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    return _dahl_shape(draw, motion) | _stribeck_shape(draw, motion) | {"bristle_time": 0.0}


def _stribeck_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    speed = motion.velocity * log_uniform(draw, 0.1, 0.5)
    return {"excess": float(draw.uniform(0.3, 1.0)), "stribeck_velocity": speed}


def _bouc_wen_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    beta = log_uniform(draw, 0.5, 8.0) / motion.displacement
    return {"beta": beta, "gamma": beta * float(draw.uniform(-0.7, 0.7)), "exponent": 1.0}


def _maxwell_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    return {"time_constant": log_uniform(draw, 0.3, 3.0) / motion.angular}


def _chamber_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    orifice = log_uniform(draw, 0.3, 3.0) * motion.displacement / motion.velocity**2
    return {"time_constant": log_uniform(draw, 0.1, 1.0) / motion.angular, "orifice": orifice}


def _gas_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    length = motion.displacement * log_uniform(draw, 5.0, 40.0)
    return {"gas_length": length, "exponent": 1.4, "side": float(draw.choice([-1.0, 1.0]))}


def _stop_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    side = float(draw.choice([-1.0, 0.0, 1.0]))
    return {"gap": motion.displacement * float(draw.uniform(0.4, 0.9)), "side": side}


def _mode_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    angular = motion.angular * log_uniform(draw, 0.8, 2.5)
    return {"angular_frequency": angular, "damping_ratio": log_uniform(draw, 0.01, 0.1)}


def _harmonic_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    return {"phase": float(draw.uniform(-np.pi, np.pi)), "order": float(draw.choice([2.0, 3.0]))}


def _dual_chamber(stiffness: float, shape: Shape) -> rig.DualChamber:
    """Two equal chambers of 0.02 m^2 at 5 bar with this stiffness, time constant and orifice."""
    area, pressure, kappa = 0.02, 5e5, 1.4
    volume = kappa * pressure * area**2 / (2.0 * stiffness)
    resistance = 2.0 * kappa * pressure * shape["time_constant"] / volume
    orifice = 4.0 * kappa * pressure * shape["orifice"] / (area * volume)
    return rig.DualChamber(area, volume, volume, resistance, orifice, pressure, kappa)


def _lugre(level: float, shape: Shape) -> rig.LugreFriction:
    return rig.LugreFriction(
        level,
        level * (1.0 + shape["excess"]),
        shape["stribeck_velocity"],
        level / shape["presliding"],
    )


GAINS = ("added_mass", "input_gain", "sensor_gain")
"""Exact: with every force law free, a scale of the mass, of the force and of the acceleration are one."""

PARSIMONY = "its special case; what sets it apart may be below what these data show"
COULOMB = {
    "dahl_friction": "a presliding displacement far below the motion is Coulomb's law",
    "bouc_wen": "a loop that saturates far below the motion is Coulomb's law",
    "lugre_friction": "stiff bristles and no Stribeck effect are Coulomb's law",
    "stribeck_friction": "equal static and sliding friction are Coulomb's law",
}

EFFECTS: dict[str, Hidden] = {
    "coulomb_friction": Hidden(
        lambda size, shape: rig.CoulombFriction(size), lambda motion: 0.25 * motion.lowest, known_by=COULOMB
    ),
    "stribeck_friction": Hidden(
        lambda size, shape: rig.StribeckFriction(size, shape["excess"], shape["stribeck_velocity"]),
        lambda motion: 0.15 * motion.lowest,
        _stribeck_shape,
        near={"coulomb_friction": PARSIMONY},
        known_by=COULOMB,
    ),
    "dahl_friction": Hidden(
        lambda size, shape: rig.DahlFriction(size, size / shape["presliding"]),
        lambda motion: 0.25 * motion.lowest,
        _dahl_shape,
        known_by={
            "bouc_wen": "with n = 1 and gamma = 0 it is Dahl's law",
            "lugre_friction": "without bristle damping and Stribeck effect it is Dahl's law",
        },
    ),
    "lugre_friction": Hidden(
        _lugre,
        lambda motion: 0.15 * motion.lowest,
        _lugre_shape,
        near={name: PARSIMONY for name in ("dahl_friction", "stribeck_friction", "coulomb_friction")},
        known_by={"bouc_wen": "it contains Dahl's law, LuGre's without the Stribeck effect"},
    ),
    "bouc_wen": Hidden(
        lambda size, shape: rig.BoucWen(size, shape["beta"], shape["gamma"]),
        lambda motion: 0.15 * motion.k1,
        _bouc_wen_shape,
        near={"dahl_friction": PARSIMONY + " (gamma = 0)"},
        known_by={"lugre_friction": "it contains Dahl's law"},
    ),
    "maxwell_branch": Hidden(
        lambda size, shape: rig.MaxwellBranch(size, shape["time_constant"]),
        lambda motion: 0.3 * motion.k1,
        _maxwell_shape,
        known_by={
            "dual_chamber": "with laminar flow it is a Maxwell branch",
            "fractional_damping": "it is a sum of Maxwell branches, one of them near",
        },
    ),
    "dual_chamber": Hidden(
        _dual_chamber,
        lambda motion: 0.3 * motion.k1,
        _chamber_shape,
        near={"maxwell_branch": PARSIMONY + " (laminar flow)"},
    ),
    "fractional_damping": Hidden(
        lambda size, shape: rig.FractionalDamping(size, shape["order"]),
        lambda motion: 0.1 * motion.k1 / motion.angular**0.5,
        lambda draw, motion: {"order": float(draw.uniform(0.2, 0.8))},
        known_by={"maxwell_branch": "one branch near the band is most of a fractional law within it"},
    ),
    "second_mode": Hidden(
        lambda size, shape: rig.SecondMode(
            size, shape["angular_frequency"] / (2.0 * np.pi), shape["damping_ratio"]
        ),
        lambda motion: 40.0,
        _mode_shape,
        known_by={name: "a mode above the band moves with the mass" for name in GAINS},
    ),
    "position_damping": Hidden(
        lambda size, shape: rig.PositionDamping(size),
        lambda motion: 0.5 * motion.c1 / motion.displacement**2,
    ),
    "quadratic_stiffness": Hidden(
        lambda size, shape: rig.QuadraticStiffness(size),
        lambda motion: 0.1 * motion.k1 / motion.displacement,
        signed=True,
        known_by={"polytropic_gas": "its first departure from a linear spring is the square of x"},
    ),
    "quintic_stiffness": Hidden(
        lambda size, shape: rig.QuinticStiffness(size),
        lambda motion: 0.1 * motion.k1 / motion.displacement**4,
        signed=True,
    ),
    "polytropic_gas": Hidden(
        lambda size, shape: rig.PolytropicGas(size, shape["gas_length"], shape["exponent"], shape["side"]),
        lambda motion: motion.k1 * motion.displacement,
        _gas_shape,
        near={"quadratic_stiffness": "beside a free cubic spring the gas law is its square of x"},
    ),
    "end_stop": Hidden(
        # The catalogue gives the mean of both stops.
        lambda size, shape: rig.EndStop(size * (1.0 + abs(shape["side"])), shape["gap"], shape["side"]),
        lambda motion: 0.5 * motion.k1,
        _stop_shape,
        near={"freeplay": "exact for a two-sided stop beside a free spring"},
    ),
    "freeplay": Hidden(
        lambda size, shape: rig.Freeplay(size, shape["gap"]),
        lambda motion: 0.3 * motion.k1,
        lambda draw, motion: {"gap": motion.displacement * float(draw.uniform(0.1, 0.6))},
        exact=("end_stop", "freeplay"),
    ),
    "added_mass": Hidden(
        lambda size, shape: rig.AddedMass(size), lambda motion: 60.0, signed=True, exact=GAINS
    ),
    "input_gain": Hidden(
        lambda size, shape: rig.InputGain(size), lambda motion: 0.08, signed=True, exact=GAINS
    ),
    "sensor_gain": Hidden(
        lambda size, shape: rig.SensorGain(size), lambda motion: 0.08, signed=True, exact=GAINS
    ),
    "input_delay": Hidden(
        lambda size, shape: rig.InputDelay(size), lambda motion: 0.1 / motion.angular, signed=True
    ),
    "input_offset": Hidden(
        lambda size, shape: rig.InputOffset(size),
        lambda motion: 0.2 * motion.lowest,
        signed=True,
        known_by={"asymmetric_friction": "with a free spring the two differ at the turning points only"},
    ),
    "sensor_offset": Hidden(
        lambda size, shape: rig.SensorOffset(size), lambda motion: 0.3 * motion.acceleration, signed=True
    ),
    "ac_coupling": Hidden(lambda size, shape: rig.AcCoupling(size), lambda motion: 0.3),
    "clipping": Hidden(
        lambda size, shape: rig.Clipping(shape["upper"]),
        lambda motion: 1.0,
        lambda draw, motion: dict.fromkeys(
            ("upper", "lower"), motion.acceleration * float(draw.uniform(0.8, 1.3))
        ),
        fixed=1.0,
    ),
    "stiffness_drift": Hidden(
        lambda size, shape: rig.StiffnessDrift(size), lambda motion: 0.05 * motion.k1, signed=True
    ),
    "mains_hum": Hidden(
        lambda size, shape: rig.MainsHum(size, shape["frequency"]),
        lambda motion: 0.1 * motion.acceleration,
        lambda draw, motion: {"frequency": float(draw.choice([50.0, 60.0]))},
    ),
    "drive_harmonics": Hidden(
        lambda size, shape: rig.DriveHarmonics(size, shape["phase"], shape["order"]),
        lambda motion: 0.05,
        _harmonic_shape,
    ),
}
"""What may be hidden. Friction that differs between directions is left out: alone it feeds energy in.

So is the motion of a floor: it means something only where a sensor on the floor is recorded. That would have
to be so in every campaign, and the scatter between cycles would then measure the noise in none of them.

So is a drive held between its samples: behind the anti-alias filter of the bench a reading of acceleration
sees the mean of both sides of each step. What is left at 4 to 7 Hz of 250 Hz is half a sample of delay, to
1e-3 of the drive: seed 6, so held, comes out as 2.004 ms of input_delay and nothing beside.

So are a skew of the clocks, which `clock_skew.py` beside this file judges, and a drift of the damping: a
further line would change what some seeds hide.
"""

COMMONEST = (
    "coulomb_friction",
    "dahl_friction",
    "bouc_wen",
    "maxwell_branch",
    "position_damping",
    "quadratic_stiffness",
    "added_mass",
    "input_delay",
    "input_offset",
    "sensor_gain",
)
"""Effects of the coverage run."""


def exact_class(name: str) -> tuple[str, ...]:
    """Give the catalogue names that no data can tell from an effect, itself included."""
    return EFFECTS[name].exact or (name,)


def family(name: str) -> tuple[str, ...]:
    """Give the names that may stand first for an effect: itself, its exact class, its special cases."""
    return (*exact_class(name), *EFFECTS[name].near)


def known_by(name: str) -> tuple[str, ...]:
    """Give the names that an effect may come out under while it is no candidate."""
    return (*exact_class(name), *EFFECTS[name].near, *EFFECTS[name].known_by)


def generator(seed: int, *words: str) -> np.random.Generator:
    """Give the random numbers of a seed and a purpose; a new purpose leaves the others as they are."""
    return np.random.default_rng([seed, *(zlib.crc32(word.encode()) for word in words)])


def shuffled_effects(seed: int) -> tuple[str, ...]:
    """Give all effects in the order in which a seed takes them; a new line in the table moves few of them."""
    return tuple(sorted(EFFECTS, key=lambda name: generator(seed, "choice", name).random()))


def element_of(
    name: str, shape: Shape, scales: elements.Scales, size: float = 0.0
) -> elements.AbstractElement:
    """Give the catalogue element of an effect; what its shape leaves out is as it guesses it."""
    guess = elements.CATALOGUE[name].guess(scales)
    return type(guess)(**{**vars(guess), **shape, guess.strength: size})
