"""Campaigns of the blind trial, drawn from a seed and filed by the rig simulator."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from _trial_effects import (
    EFFECTS,
    Motion,
    Shape,
    element_of,
    exact_class,
    generator,
    log_uniform,
    shuffled_effects,
)
from _trial_outside import OUTSIDE
from isojax import elements, rig
from isojax.identification import fit, read_campaign, scales
from isojax.identification.diagnosis._score import score_test
from isojax.identification.fitting import Search
from isojax.models import Isolator

CLASSES = ("none", "one", "two", "outside")
SHARES = (0.25, 0.45, 0.15, 0.15)
"""How often each class is drawn."""

SIGNIFICANT = 3.5
"""Standard errors that are one detection limit."""

RATE = 250.0
CYCLES = 20
DWELLS = (1250, 1160, 1080, 1010, 950, 900, 850, 800)
"""Samples of the dwells, 4.0 to 6.25 Hz: their sum and the longest are the same in every campaign."""

SECONDS = sum(DWELLS) / RATE
PERIOD = 8.0
PAPER = (1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6)
LARGEST = 30.0
"""Largest size, in detection limits."""


@dataclass(frozen=True)
class Sketch:
    """A campaign as drawn, before the size of what it hides is known.

    Args:
        seed: of everything.
        kind: "none", "one", "two", "outside", or "coverage" (one effect that a test can see).
        base: the six coefficients of the plant.
        layout: "stepped", "swept" or "mixed".
        levels: force amplitudes of the fitted and of the held-out records, N.
        plans: what to test.
        bench: how it is measured.
        names: what to hide, in the order of choice: the first that leave a trace are hidden.
    """

    seed: int
    kind: str
    base: tuple[float, ...]
    layout: str
    levels: tuple[float, ...]
    plans: tuple[rig.Plan, ...]
    bench: rig.Bench
    names: tuple[str, ...]

    @property
    def plant(self) -> rig.Plant:
        """The plant without what is hidden."""
        return rig.Plant(rig.base_laws(*self.base))

    @property
    def fitted_plans(self) -> tuple[rig.Plan, ...]:
        """The plans without the one that is held out."""
        return self.plans[:-1]

    @property
    def model(self) -> Isolator:
        """The true declared model."""
        laws = (
            elements.LinearStiffness,
            elements.AbsQuadraticStiffness,
            elements.CubicStiffness,
            elements.LinearDamping,
            elements.AbsQuadraticDamping,
            elements.CubicDamping,
        )
        return Isolator(800.0, tuple(law(value) for law, value in zip(laws, self.base, strict=True)))  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True)
class Secret:
    """One hidden effect.

    Args:
        name: catalogue name, or that of a law outside the catalogue.
        size: strength in the unit of the catalogue; NaN outside of it.
        limit: detection limit in that unit.
        shape: its other coefficients.
        law: the rig's law.
    """

    name: str
    size: float
    limit: float
    shape: Shape
    law: rig.Law | rig.Instrument


def kind_of(seed: int) -> str:
    """Give the class of a seed."""
    return str(generator(seed, "kind").choice(CLASSES, p=SHARES))


def sketch(seed: int, kind: str | None = None, names: tuple[str, ...] | None = None) -> Sketch:
    """Draw a campaign.

    Args:
        seed: of everything.
        kind: its class, drawn if omitted.
        names: what it hides, drawn if omitted.
    """
    kind = kind_of(seed) if kind is None else kind
    draw = generator(seed, "bench")
    base = tuple(float(value) for value in np.array(PAPER) * draw.uniform(0.9, 1.1, 6))
    top = draw.uniform(90.0, 170.0)
    levels = top * np.array(
        [draw.uniform(0.3, 0.45), draw.uniform(0.55, 0.75), 1.0, draw.uniform(0.45, 0.95)]
    )
    levels = tuple(float(level) for level in np.round(levels, 1))
    layout = str(draw.choice(["stepped", "swept", "mixed"], p=[0.6, 0.2, 0.2]))
    counts = np.array(DWELLS)
    for first, last in ((1, 6), (2, 5), (3, 4)):
        moved = int(draw.integers(-20, 21))
        counts[first] += moved
        counts[last] -= moved
    shaker = rig.Shaker(
        second=draw.uniform(0.0, 0.02),
        second_phase=draw.uniform(0.0, 6.28),
        third=draw.uniform(0.0, 0.012),
        third_phase=draw.uniform(0.0, 6.28),
        dropout=draw.uniform(0.0, 0.2),
        dropout_frequency=draw.uniform(4.6, 5.8),
    )
    bench = rig.Bench(
        rate=RATE,
        noise=log_uniform(draw, 0.003, 0.02),
        force_noise=draw.uniform(0.0, 0.05),
        drift=draw.uniform(0.0, 0.002),
        shaker=shaker,
        tolerance=1e-7,  # of the motion: below 1e-4 of the noise
    )
    frequencies = tuple((CYCLES * RATE / counts).tolist())
    plans = _plans(layout, levels, frequencies, draw)
    if kind == "coverage":
        # Intervals need no more than the levels that part the six coefficients.
        layout = "stepped"
        plans = rig.SteppedSine((levels[0], levels[2]), frequencies, CYCLES, ("forward",)), plans[-1]
    if names is None:
        names = _names(seed, kind)
    return Sketch(seed, kind, base, layout, levels, plans, bench, names)


def _names(seed: int, kind: str) -> tuple[str, ...]:
    if kind == "outside":
        return (str(generator(seed, "outside").choice(sorted(OUTSIDE))),)
    return () if kind == "none" else shuffled_effects(seed)


def _plans(
    layout: str, levels: tuple[float, ...], frequencies: tuple[float, ...], draw: np.random.Generator
) -> tuple[rig.Plan, ...]:
    """Four records to fit and two to hold out."""
    low, middle, high, held = levels
    both = ("forward", "backward")
    span = draw.uniform(2.2, 2.6)

    def sines(levels: tuple[float, ...], directions: tuple, holdout: tuple[float, ...] = ()) -> rig.Plan:
        if layout == "swept":
            return rig.SweptSine(levels, 4.0, 4.0 + span, span / SECONDS, directions, holdout_levels=holdout)
        return rig.SteppedSine(levels, frequencies, CYCLES, directions, holdout_levels=holdout)

    held_out = sines((), both, (held,))
    if layout == "mixed":
        noise = rig.Multisine((round(0.4 * high, 1),), 2.0, 12.0, PERIOD, round(SECONDS / PERIOD))
        first = sines((low, high), ("forward",))
        return first, sines((middle,), ("backward",)), noise, held_out
    if draw.random() < 0.5:
        return sines((low, high), both), held_out
    return sines((low, middle, high), ("forward",)), sines((high,), ("backward",)), held_out


@dataclass(frozen=True)
class Traces:
    """What the effects would leave in a campaign that hides none of them.

    Args:
        motion: how the plant moves.
        shapes: of every effect, as drawn.
        limits: detection limit of every effect that leaves a trace, in the unit of its strength.
    """

    motion: Motion
    shapes: dict[str, Shape]
    limits: dict[str, float]


@lru_cache(maxsize=1)
def traces(seed: int, kind: str) -> Traces:
    """Measure the twin that hides nothing, and see what the effects would leave in it.

    One detection limit is 3.5 standard errors of the strength beside the true declared model, over all
    scatters of the stiffness that the records allow. It is read off the score test of the twin, the shape of
    the effect being known. The seed alone says all of it, so that it serves every effect that is hidden under
    the same seed.

    Args:
        seed: of the campaign.
        kind: its class.
    """
    drawn = sketch(seed, kind, ())
    with TemporaryDirectory() as folder:
        path = rig.write_campaign(Path(folder), drawn.plant, drawn.fitted_plans, seed, "twin", drawn.bench)
        innocent = fit(drawn.model, read_campaign(path))
    motion = motion_of(drawn, innocent)
    if kind == "outside":
        return Traces(motion, {}, {})
    # All effects are tested, so that the shapes, and with them the compiled code, are those of every seed.
    shapes = {name: effect.shape(generator(seed, "shape", name), motion) for name, effect in EFFECTS.items()}
    magnitudes = scales(innocent.campaign)
    probes = tuple(element_of(name, shapes[name], magnitudes) for name in EFFECTS)
    test = score_test(innocent.estimate, Search(magnitudes), probes)
    limits = {score.element.name: SIGNIFICANT * score.error for score in test.scores}
    return Traces(motion, shapes, limits)


def motion_of(drawn: Sketch, innocent) -> Motion:
    """Give how the plant moves without what is hidden."""
    magnitudes = scales(innocent.campaign)
    return Motion(
        min(drawn.levels),
        magnitudes.displacement,
        magnitudes.acceleration,
        magnitudes.angular_frequency,
        drawn.base[0],
        drawn.base[3],
    )


def secrets(drawn: Sketch) -> tuple[Secret, ...]:
    """Draw how large the hidden effects are, in detection limits.

    Args:
        drawn: the campaign.
    """
    seen = traces(drawn.seed, drawn.kind)
    motion, shapes, limits = seen.motion, seen.shapes, seen.limits
    if drawn.kind == "outside":
        draw = generator(drawn.seed, "outside", *drawn.names)
        force = motion.lowest * log_uniform(draw, 0.1, 0.4)
        (name,) = drawn.names
        return (Secret(name, float("nan"), float("nan"), {}, OUTSIDE[name](draw, motion, force)),)
    hidden: list[Secret] = []
    for name in drawn.names:
        apart = not any(name in exact_class(other.name) for other in hidden)
        if len(hidden) < (2 if drawn.kind == "two" else 1) and apart and name in limits:
            hidden.append(_secret(drawn, name, shapes[name], limits[name], motion))
    return tuple(hidden)


def _secret(drawn: Sketch, name: str, shape: Shape, limit: float, motion: Motion) -> Secret:
    effect = EFFECTS[name]
    draw = generator(drawn.seed, "size", name)
    # The smaller of two effects must be one that a test can see, else there is but one; the interval of one
    # that it cannot see ends at the bound of its sign.
    smallest = 1.0 if drawn.kind == "one" else 3.0
    size = min(limit * log_uniform(draw, smallest, LARGEST), effect.most(motion))
    if effect.fixed is not None:
        size = effect.fixed
    if effect.signed and draw.random() < 0.5:
        size = -size
    return Secret(name, size, limit, shape, effect.law(size, shape))


def file_campaign(drawn: Sketch, hidden: tuple[Secret, ...], folder: Path, held_out: bool = True) -> Path:
    """File the campaign; where the plant runs away the effect is too large, which the caller hears of."""
    plant = drawn.plant.plus(*(secret.law for secret in hidden))
    plans = drawn.plans if held_out else drawn.fitted_plans
    return rig.write_campaign(folder, plant, plans, drawn.seed, "blind", drawn.bench)
