"""Campaigns of the simulated bench, straight into memory."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from isojax import rig
from isojax.records import Campaign, Dwell, InputChannel, OutputChannel, Record

UNITS = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}


def _as_record(one: rig.SimulatedRecord) -> Record:
    edges = [round(start * one.rate) for start, _, _ in one.schedule] + [one.time.size]
    dwells = tuple(
        Dwell(edges[place], edges[place + 1], frequency, cycles)
        for place, (_, frequency, cycles) in enumerate(one.schedule)
    )
    released = not np.any(np.abs(one.force) > 1e-6 * max(1.0, one.level))
    kind = (
        "stepped_sine" if dwells else "periodic" if one.period else "free_decay" if released else "broadband"
    )
    return Record(
        one.name,
        Path(f"{one.name}.npz"),
        one.time,
        one.rate,
        one.force,
        one.output,
        one.force,
        one.output,
        level=one.level,
        direction=one.direction,
        repeat=one.repeat,
        role=one.role,
        period=one.period,
        settle=one.settle,
        dwells=dwells,
        kind=kind,
        floor=one.floor,
        pressure=one.pressure,
    )


def _hold_of(records: tuple[Record, ...], **changes) -> Campaign:
    """A campaign around given records; a change names a field of it or of a channel."""
    drive = InputChannel("force", "force", "N")
    quantity = changes.get("output", {}).get("quantity", "acceleration")
    output = OutputChannel(quantity, quantity, UNITS[quantity])
    fields = {
        "title": "bench",
        "file": Path("bench/campaign.toml"),
        "mass": 800.0,
        "mass_free": False,
        "input": dataclasses.replace(drive, **changes.pop("input", {})),
        "output": dataclasses.replace(output, **changes.pop("output", {})),
        "filter": None,
        "rate": records[0].rate,
        "stiffness": ("linear", "abs_quadratic", "cubic"),
        "damping": ("linear", "abs_quadratic", "cubic"),
        "elements": (),
        "records": tuple(records),
    }
    return Campaign(**{**fields, **changes})


@pytest.fixture(scope="session")
def as_record() -> Callable[[rig.SimulatedRecord], Record]:
    """Gives the function that makes a simulated record one of the reader's."""
    return _as_record


@pytest.fixture(scope="session")
def campaign_of() -> Callable[..., Campaign]:
    """Gives the function that puts records into a campaign."""
    return _hold_of


@pytest.fixture(scope="session")
def simulated() -> Callable[..., Campaign]:
    """Gives the function that runs a plan on a plant and puts the records into a campaign."""

    def simulate(plant, plan, seed=1, bench=None, **changes) -> Campaign:
        bench = bench or rig.Bench(rate=250.0, drift=0.0, force_noise=0.0, anti_alias=False, tolerance=1e-7)
        records = tuple(_as_record(one) for one in rig.run(plant, plan, seed, bench))
        changes.setdefault("mass", plant.mass)
        changes["output"] = {"quantity": bench.output, "noise": bench.noise, **changes.get("output", {})}
        return _hold_of(records, **changes)

    return simulate
