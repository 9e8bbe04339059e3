"""Start from motions that ring down: the harmonic balance of every half cycle, as if it were a dwell."""

import numpy as np

from ...elements import CATALOGUE
from ...models import Isolator
from ...records import Campaign, Record, driven_samples
from ._dwell_balance import dwell_balance, dwell_motion
from ._force_balance import BalanceFit
from ._logarithmic_decrement import about_rest, logarithmic_decrement
from ._measured_receptance import MeasuredResponse
from ._physical_fit import fit_physically

_SMOOTHING = np.array([0.25, 0.5, 0.25])
"""Weights of a half cycle and its neighbours: what differs between the two sides of rest drops out."""

_HALF_CYCLES_A_COEFFICIENT = 1
"""Half cycles per coefficient that the balance needs at least; each gives a spring and a damper equation."""


def decaying_response(campaign: Campaign, record: Record) -> MeasuredResponse:
    """Give the half cycles of a free decay as the dwells of a drive that makes up for the decay.

    `x = X exp(-alpha t) sin(omega t)` obeys the balance of a steady motion under the force
    `m X (alpha^2 + 2 i alpha omega)`, in phase and ahead by a quarter.

    Args:
        campaign: says what the channels measure, and the mass.
        record: a free decay, or a blow and what follows it.

    Returns:
        A line per half cycle, the first and the last left out; none where the decay has fewer than three.
    """
    order = {"displacement": 0, "velocity": 1, "acceleration": 2}[campaign.output.quantity]
    driven = np.flatnonzero(driven_samples(record.input))
    begin = int(driven[-1]) + 1 if driven.size else 0
    cycles = logarithmic_decrement(about_rest(record.output)[begin:], record.rate)
    nothing = np.zeros(0)
    if cycles.amplitude.size < 3:
        empty = np.zeros((0, 1), complex)
        return MeasuredResponse(record.name, record.level, record.direction, nothing, empty, empty, nothing)
    half = np.convolve(0.5 / cycles.frequency, _SMOOTHING, mode="valid")
    size = np.convolve(np.log(cycles.amplitude), _SMOOTHING, mode="valid")
    omega = np.pi / half
    alpha = 0.5 * np.log(cycles.amplitude[:-2] / cycles.amplitude[2:]) / half
    displacement = np.exp(size) / np.hypot(omega, alpha) ** order
    force = campaign.mass * displacement * (alpha**2 + 2j * alpha * omega)
    return MeasuredResponse(
        record.name,
        record.level,
        record.direction,
        omega / (2.0 * np.pi),
        force[:, None],
        displacement[:, None].astype(complex),
        nothing,
    )


def start_from_decays(
    campaign: Campaign, base: Isolator, names: tuple[str, ...], records: tuple[Record, ...]
) -> tuple[BalanceFit, tuple[str, ...]] | None:
    """Start from the half cycles of motions that ring down; the mass stays as declared.

    The force balance in time would need the displacement at the start of the record, where the motion is
    largest and its integral least known.

    Args:
        campaign: says what the channels measure, and the mass.
        base: the declared structure.
        names: catalogue names of the elements to fit.
        records: free decays and blows.

    Returns:
        The fit and its notes, of the linear coefficients alone where the decays are too short to
        determine all of them; None where they are too short for those too.
    """
    responses = tuple(decaying_response(campaign, record) for record in records)
    half_cycles, few = sum(one.frequency.size for one in responses), ()
    if half_cycles < _HALF_CYCLES_A_COEFFICIENT * len(names):
        linear = tuple(name for name in names if CATALOGUE[name].proportional_to)
        if not linear or half_cycles < _HALF_CYCLES_A_COEFFICIENT * len(linear):
            return None
        few = (
            f"The decays have {half_cycles} half cycles, too few for {len(names)} coefficients: all but "
            "the linear ones start at zero.",
        )
        names = linear
    motion = dwell_motion(base, responses)
    highest, fastest = (float(np.max(np.abs(s))) for s in (motion.displacement, motion.velocity))
    found, notes = fit_physically(dwell_balance(base, responses).fit, names, highest, fastest)
    # The balance is judged by the force that makes up for the decay; without a drive, inertia is what counts.
    made_up = np.concatenate([one.force[:, 0] for one in responses])
    inertia = campaign.mass * np.concatenate(
        [(2.0 * np.pi * one.frequency) ** 2 * one.displacement[:, 0] for one in responses]
    )
    share = float(np.linalg.norm(made_up) / np.linalg.norm(inertia))
    return BalanceFit(found.model, found.unexplained * share, found.fitted), (*few, *notes)
