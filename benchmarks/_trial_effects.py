"""What the blind trial may hide in a campaign: one line an effect in `EFFECTS`.

Each line gives the law of the simulated rig, the catalogue element of the same law at zero strength (whose
information sets the detection limit, and which the oracle fits), random shapes, the signs that are physical,
and a cap: the largest strength that leaves the motion a small change of the plant's own.
"""

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

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


@dataclass(frozen=True)
class Hidden:
    """One kind of effect that may be hidden.

    Args:
        law: the rig's law of a strength (in the unit of the catalogue) and a shape.
        probe: the catalogue element of a shape, at zero strength.
        most: largest strength.
        shape: draws the shape; empty where the law has none.
        signed: whether a negative strength is drawn, too.
        exact: catalogue names of the same trace, this one included, where no data can part them.
        known_by: names that the effect may come out under while it is not a candidate itself, with reasons.
    """

    law: Callable[[float, Shape], Effect]
    probe: Callable[[Shape], elements.AbstractElement]
    most: Callable[[Motion], float]
    shape: Callable[[np.random.Generator, Motion], Shape] = lambda draw, motion: {}
    signed: bool = False
    exact: tuple[str, ...] = ()
    known_by: dict[str, str] | None = None


def log_uniform(draw: np.random.Generator, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform."""
    return float(np.exp(draw.uniform(np.log(low), np.log(high))))


def _dahl_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    return {"presliding": motion.displacement * log_uniform(draw, 0.05, 1.0)}


def _bouc_wen_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    beta = log_uniform(draw, 0.5, 8.0) / motion.displacement
    return {"beta": beta, "gamma": beta * float(draw.uniform(-0.7, 0.7))}


def _maxwell_shape(draw: np.random.Generator, motion: Motion) -> Shape:
    return {"time_constant": log_uniform(draw, 0.3, 3.0) / motion.angular}


GAINS = ("added_mass", "input_gain", "sensor_gain")
"""Exact: with every force law free, a scale of the mass, of the force and of the acceleration are one."""

EFFECTS: dict[str, Hidden] = {
    "coulomb_friction": Hidden(
        lambda size, shape: rig.CoulombFriction(size),
        lambda shape: elements.CoulombFriction(0.0, 1e-4),
        lambda motion: 0.25 * motion.lowest,
        known_by={
            "dahl_friction": "a presliding displacement far below the motion is Coulomb's law",
            "bouc_wen": "a loop that saturates far below the motion is Coulomb's law",
            "lugre_friction": "stiff bristles and no Stribeck effect are Coulomb's law",
            "stribeck_friction": "equal static and sliding friction are Coulomb's law",
            "asymmetric_friction": "equal sides are Coulomb's law",
        },
    ),
    "dahl_friction": Hidden(
        lambda size, shape: rig.DahlFriction(size, size / shape["presliding"]),
        lambda shape: elements.DahlFriction(0.0, shape["presliding"]),
        lambda motion: 0.25 * motion.lowest,
        _dahl_shape,
        known_by={
            "bouc_wen": "with n = 1 and gamma = 0 it is Dahl's law",
            "lugre_friction": "without bristle damping and Stribeck effect it is Dahl's law",
        },
    ),
    "bouc_wen": Hidden(
        lambda size, shape: rig.BoucWen(size, shape["beta"], shape["gamma"]),
        lambda shape: elements.BoucWen(0.0, shape["beta"], shape["gamma"], 1.0),
        lambda motion: 0.15 * motion.k1,
        _bouc_wen_shape,
        known_by={
            "dahl_friction": "it is the same law with gamma = 0, and gamma is the weaker part",
            "lugre_friction": "it contains Dahl's law",
        },
    ),
    "maxwell_branch": Hidden(
        lambda size, shape: rig.MaxwellBranch(size, shape["time_constant"]),
        lambda shape: elements.MaxwellBranch(0.0, shape["time_constant"]),
        lambda motion: 0.3 * motion.k1,
        _maxwell_shape,
        known_by={
            "dual_chamber": "with laminar flow it is a Maxwell branch",
            "fractional_damping": "it is a sum of Maxwell branches, one of them near",
        },
    ),
    "position_damping": Hidden(
        lambda size, shape: rig.PositionDamping(size),
        lambda shape: elements.PositionDamping(0.0),
        lambda motion: 0.5 * motion.c1 / motion.displacement**2,
    ),
    "quadratic_stiffness": Hidden(
        lambda size, shape: rig.QuadraticStiffness(size),
        lambda shape: elements.QuadraticStiffness(0.0),
        lambda motion: 0.1 * motion.k1 / motion.displacement,
        signed=True,
        known_by={"polytropic_gas": "its first departure from a linear spring is the square of x"},
    ),
    "added_mass": Hidden(
        lambda size, shape: rig.AddedMass(size),
        lambda shape: elements.AddedMass(0.0),
        lambda motion: 60.0,
        signed=True,
        exact=GAINS,
    ),
    "input_gain": Hidden(
        lambda size, shape: rig.InputGain(size),
        lambda shape: elements.InputGain(0.0),
        lambda motion: 0.08,
        signed=True,
        exact=GAINS,
    ),
    "sensor_gain": Hidden(
        lambda size, shape: rig.SensorGain(size),
        lambda shape: elements.SensorGain(0.0),
        lambda motion: 0.08,
        signed=True,
        exact=GAINS,
    ),
    "input_delay": Hidden(
        lambda size, shape: rig.InputDelay(size),
        lambda shape: elements.InputDelay(0.0),
        lambda motion: 0.1 / motion.angular,
        signed=True,
    ),
    "input_offset": Hidden(
        lambda size, shape: rig.InputOffset(size),
        lambda shape: elements.InputOffset(0.0),
        lambda motion: 0.2 * motion.lowest,
        signed=True,
    ),
    "sensor_offset": Hidden(
        lambda size, shape: rig.SensorOffset(size),
        lambda shape: elements.SensorOffset(0.0),
        lambda motion: 0.3 * motion.acceleration,
        signed=True,
    ),
}

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


def known_by(name: str) -> dict[str, str]:
    """Give the names, with reasons, that an effect may come out under while it is no candidate."""
    return EFFECTS[name].known_by or {}


def generator(seed: int, *words: str) -> np.random.Generator:
    """Give the random numbers of a seed and a purpose; a new purpose leaves the others as they are."""
    return np.random.default_rng([seed, *(zlib.crc32(word.encode()) for word in words)])


def chosen_effects(seed: int, count: int) -> list[str]:
    """Draw effects of different exact classes; a new line in the table changes few of the draws."""
    order = sorted(EFFECTS, key=lambda name: generator(seed, "choice", name).random())
    kept: list[str] = []
    for name in order:
        if len(kept) < count and not any(name in exact_class(other) for other in kept):
            kept.append(name)
    return kept


def with_size(probe: elements.AbstractElement, size: float) -> elements.AbstractElement:
    """Give an element with another strength."""
    numbers: dict[str, Any] = {**vars(probe), probe.strength: size}
    return type(probe)(**numbers)
