"""The model of the paper's own route: resonance points, quadratic fits, averages, inversion."""

import dataclasses
from typing import Literal

import numpy as np
from jaxtyping import Float

from ... import elements
from ..._show import shown
from ...models import Isolator
from ._equivalent_law import EquivalentLaw, MeasuredResonance, fit_equivalent_law, measured_resonance
from ._measured_receptance import MeasuredResponse
from ._physical_fit import unphysical_side


@shown
@dataclasses.dataclass(frozen=True, eq=False)
class PaperTable:
    """Resonances of the records and the laws that follow from them.

    Attributes:
        resonances: one a record that has a resonance.
        stiffness: equivalent stiffness [N/m] over displacement amplitude [m]; None without usable resonances.
        damping: equivalent damping [N s/m] over velocity amplitude [m/s]; None without usable half-power
            points.
        model: the isolator with these laws, their order reduced until they are physical; None where they
            never are.
        notes: what the reader must know of the fits, a sentence each.

    Source: the paper, sec. 4.
    """

    resonances: tuple[MeasuredResonance, ...]
    stiffness: EquivalentLaw | None
    damping: EquivalentLaw | None
    model: Isolator | None
    notes: tuple[str, ...]


def _equivalent_points(
    resonances: tuple[MeasuredResonance, ...], side: str
) -> dict[str, Float[np.ndarray, "_ 2"]]:
    """Give amplitude and equivalent coefficient by sweep direction."""
    rows: dict[str, list[tuple[float, float]]] = {}
    for one in resonances:
        speed = 2 * np.pi * one.frequency * one.amplitude
        row = (one.amplitude, one.stiffness) if side == "stiffness" else (speed, one.damping)
        rows.setdefault(one.direction, []).append(row)
    return {direction: np.array(found) for direction, found in rows.items()}


def paper_isolator(
    mass: float, stiffness: Float[np.ndarray, " power"], damping: Float[np.ndarray, " power"]
) -> Isolator:
    """Give the isolator with polynomial laws of the paper's form.

    Args:
        mass: moving mass [kg].
        stiffness: k1, k2, k3 of k1 x + k2 |x|x + k3 x^3 [N/m, N/m^2, N/m^3].
        damping: c1, c2, c3 of c1 v + c2 |v|v + c3 v^3 [N s/m, ...].

    Returns:
        The isolator.

    Source: the paper, eqs. (4), (13), (18).
    """
    springs = (elements.LinearStiffness, elements.AbsQuadraticStiffness, elements.CubicStiffness)
    dampers = (elements.LinearDamping, elements.AbsQuadraticDamping, elements.CubicDamping)
    laws = zip((*springs, *dampers), (*stiffness, *damping), strict=True)
    forces = tuple(law(float(value)) for law, value in laws)
    return Isolator(mass, forces)  # pyright: ignore[reportArgumentType]


def paper_table(
    responses: tuple[MeasuredResponse, ...],
    mass: float,
    damping: Literal["half_power", "circle"] = "half_power",
    resonance: Literal["peak", "phase"] = "peak",
) -> PaperTable:
    """Follow the paper from receptances to a model.

    Args:
        responses: measured receptance of each record.
        mass: moving mass [kg].
        damping: where the damping ratio comes from.
        resonance: which resonance counts.

    Returns:
        Resonances, equivalent laws, model and notes.

    Source: the paper, eqs. (9)-(13), (15)-(18).
    """
    found = [measured_resonance(response, mass, damping, resonance) for response in responses]
    resonances = tuple(one for one in found if one is not None)
    notes: list[str] = []
    jumped = [one.record for one in resonances if one.half_power.jump_inside]
    if jumped:
        notes.append(
            f"A jump lies between the half-power points of {', '.join(jumped)}: eq. (9) does not apply there."
        )
    without = [one.record for one in resonances if not np.isfinite(one.damping_ratio)]
    if without:
        notes.append(f"No damping ratio from {', '.join(without)}: the sweep ends too early for it.")
    for order in (2, 1, 0):
        laws = {
            side: fit_equivalent_law(_equivalent_points(resonances, side), side, order)
            for side in ("stiffness", "damping")
        }
        (spring, spring_notes), (damper, damper_notes) = laws["stiffness"], laws["damping"]
        if spring is None or damper is None:
            return PaperTable(resonances, spring, damper, None, (*notes, *spring_notes, *damper_notes))
        highest = max(float(np.max(rows[:, 0])) for rows in spring.points)
        fastest = max(float(np.max(rows[:, 0])) for rows in damper.points)
        pad = (0, 2 - order)
        model = paper_isolator(mass, np.pad(spring.law, pad), np.pad(damper.law, pad))
        side = unphysical_side(model, highest, fastest)
        if side is None:
            return PaperTable(resonances, spring, damper, model, (*notes, *spring_notes, *damper_notes))
        notes.append(
            f"With polynomials of order {order} the paper's route gives a {side} law that is not physical "
            "over the measured range."
        )
    return PaperTable(resonances, spring, damper, None, tuple(notes))
