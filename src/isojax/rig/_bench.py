"""Running a plan on a plant: from force balance to noisy records."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from ._force_pieces import ForcePiece, forces_of
from ._law import Stretch
from ._motion_equation import EquationOfMotion
from ._plan import Direction, Plan, Role, Trial
from ._plant import Plant
from ._sampling import anti_alias_taps, decimated, oversampling
from ._shaker import EXAMPLE_SHAKER, Shaker
from ._solver import PlantIntegrator

Quantity = Literal["acceleration", "velocity", "displacement"]


@dataclass(frozen=True)
class Bench:
    """The measuring side of the rig.

    Args:
        rate: samples per second.
        output: what the sensor on the mass measures.
        noise: rms of the white noise on the output, in its SI unit.
        force_noise: rms of the white noise on the recorded force, N.
        drift: standard deviation of the linear stiffness from record to record, as a share of it.
        shaker: what drives the plant.
        anti_alias: filter both channels before sampling; otherwise the record holds the exact values at each
            instant.
        tolerance: local error of the integration, see `PlantIntegrator`.
    """

    rate: float = 1000.0
    output: Quantity = "acceleration"
    noise: float = 0.01
    force_noise: float = 0.02
    drift: float = 0.0005
    shaker: Shaker = EXAMPLE_SHAKER
    anti_alias: bool = True
    tolerance: float = 3e-10


DEFAULT_BENCH = Bench()
"""Acceleration at 1000 Hz with the noise, drift and shaker of the example campaigns."""


@dataclass(frozen=True, eq=False)
class SimulatedRecord:
    """One record as the bench would file it.

    Args:
        name: file stem.
        time: s.
        force: recorded force, N.
        output: recorded output, SI.
        rate: Hz.
        level: N (m for a free decay).
        direction: of the frequency over time.
        repeat: number of the repeat, from 0.
        role: whether the record may be used to fit.
        schedule: start in s, frequency in Hz and cycles of each dwell.
        period: of a periodic force, samples.
        settle: samples at the start.
        stiffness_scale: by which the linear stiffness had drifted.
        floor: recorded acceleration of the floor, m/s^2; None where it is not measured.
        pressure: in the chamber, Pa; None where it is not recorded.
    """

    name: str
    time: Float[np.ndarray, " time"]
    force: Float[np.ndarray, " time"]
    output: Float[np.ndarray, " time"]
    rate: float
    level: float
    direction: Direction
    repeat: int
    role: Role
    schedule: tuple[tuple[float, float, float], ...]
    period: int | None
    settle: int
    stiffness_scale: float
    floor: Float[np.ndarray, " time"] | None = None
    pressure: float | None = None


def response(
    plant: Plant,
    pieces: Sequence[ForcePiece],
    times: Float[np.ndarray, " time"],
    displacement: float = 0.0,
    tolerance: float = 3e-10,
) -> dict[str, Float[np.ndarray, " time"]]:
    """Exact motion of the plant, let go at rest when the first piece starts.

    Args:
        plant: the plant; its instruments play no part.
        pieces: the acting force; the last one must reach the last instant.
        times: increasing instants, s.
        displacement: at the start, m.
        tolerance: local error of the integration.

    Returns:
        "displacement", "velocity", "acceleration" and "force", (time,) each, SI; where the floor moves the
        first two are relative to it.
    """
    balance = EquationOfMotion(plant)
    path = PlantIntegrator(balance, tolerance).run(pieces, [displacement] + [0.0] * (balance.order - 1))
    states, sides, stuck = path.at(times)
    force = forces_of(pieces, times)
    acceleration = np.asarray(balance.acceleration(times, states, force, sides, stuck))
    return {"displacement": states[0], "velocity": states[1], "acceleration": acceleration, "force": force}


def run(
    plant: Plant, plan: Plan | Sequence[Plan], seed: int, bench: Bench = DEFAULT_BENCH
) -> tuple[SimulatedRecord, ...]:
    """Records of a plan, or of several one after the other.

    Args:
        plant: the plant.
        plan: what to test.
        seed: draws noise, drift and multisine phases; the same seed gives the same records to the bit.
        bench: how it is measured.

    Returns:
        The records in the order of the test.

    Raises:
        ValueError: if two trials of the plans have the same name.
    """
    plans = [plan] if isinstance(plan, Plan) else list(plan)
    trials = [trial for one in plans for trial in one.trials(bench.shaker, seed)]
    names = [trial.name for trial in trials]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"Argument `plan` must name each record once, but {name!r} comes up twice.")
    ends = np.cumsum([0.0, *(trial.seconds for trial in trials)])
    shares = (ends / ends[-1]).tolist()
    records = []
    for index, trial in enumerate(trials):
        stretch = Stretch(shares[index], shares[index + 1], trial.seconds, trial.pressure)
        placed = plant.placed(stretch, np.random.default_rng([seed, 2, index]))
        records.append(_record(placed, trial, bench, np.random.default_rng([seed, 0, index])))
    return tuple(records)


def _record(plant: Plant, trial: Trial, bench: Bench, draw: np.random.Generator) -> SimulatedRecord:
    """Simulate one trial and measure it."""
    scale = 1 + bench.drift * float(draw.standard_normal())
    count = int(trial.seconds * bench.rate * (1 + 1e-12))
    factor = oversampling(bench.rate) if bench.anti_alias else 1
    taps = anti_alias_taps(bench.rate) if bench.anti_alias else np.ones(1)
    reach = taps.size // 2
    times = np.arange(-reach, (count - 1) * factor + reach + 1) / (factor * bench.rate)
    end = max(float(times[-1]), trial.pieces[-1].stop) + abs(plant.lag) + 1 / bench.rate
    pieces = [*trial.pieces[:-1], trial.pieces[-1].lasting_until(end)]

    acting = pieces
    for instrument in plant.instruments:
        acting = instrument.acting(acting, bench.rate)
    acting = [piece.delayed(plant.lag) for piece in acting]
    motion = response(plant.drifted(scale), acting, times, trial.displacement, bench.tolerance)
    force, output = forces_of(pieces, times), motion[bench.output]
    for instrument in plant.instruments:
        force = instrument.recorded_force(times, force)
        output = instrument.recorded_output(times, output)
    force, output = decimated(force, taps, factor), decimated(output, taps, factor)
    shown = [law.floor_sensor(times) for law in plant.laws if law.moves_floor]
    sensed = [decimated(one, taps, factor) for one in shown if one is not None]
    return SimulatedRecord(
        name=trial.name,
        time=np.arange(count) / bench.rate,
        force=force + bench.force_noise * draw.standard_normal(count),
        output=output + bench.noise * draw.standard_normal(count),
        rate=bench.rate,
        level=trial.level,
        direction=trial.direction,
        repeat=trial.repeat,
        role=trial.role,
        schedule=trial.schedule,
        period=None if trial.period is None else round(trial.period * bench.rate),
        settle=round(trial.settle * bench.rate),
        stiffness_scale=scale,
        floor=sum(sensed[1:], sensed[0]) if sensed else None,
        pressure=trial.pressure,
    )
