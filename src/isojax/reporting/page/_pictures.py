"""The pictures of the report, drawn."""

import base64
import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._progress import step
from ..._results import is_successful
from ...health import CampaignHealth
from ...identification import ClassicalGuess, Fit, Loop, residual
from ..plots import (
    Slice,
    centre_frequency,
    effect_on_its_own,
    measured_forces,
    pair,
    plot_correlation,
    plot_cycle_residual,
    plot_dwell_stability,
    plot_effect,
    plot_equivalent,
    plot_errors,
    plot_force_residual_loops,
    plot_force_residual_map,
    plot_ranking,
    plot_receptance,
    plot_remainder_map,
    plot_residual,
    plot_response_bands,
    plot_restoring_force,
    plot_stiffness_scatter,
    plot_time_history,
    plot_where,
    telling_slice,
    trace_cycles,
    visited_amplitudes,
    worst_window,
)
from ._identified_response import IdentifiedResponse
from ._or_a_line import or_a_line
from ._png import png_bytes

_THIRD, _HALF, _WHOLE, _HEIGHT = 3.8, 4.6, 11.0, 2.9
"""Sizes [inch]: on a wide screen three pictures stand side by side, on a telephone one fills the width, and
the letters can be read on both."""


class Picture(NamedTuple):
    """A picture in the report.

    Attributes:
        name: what it shows, a few words.
        caption: how to read it.
        png: the file; empty where the picture could not be drawn, and the caption says why.
        wide: whether it takes the whole width.
    """

    name: str
    caption: str
    png: bytes
    wide: bool = False

    @property
    def data(self) -> str:
        """The file as base64."""
        return base64.b64encode(self.png).decode("ascii")

    @property
    def file(self) -> str:
        """Name of the file beside report.md."""
        return f"report_{re.sub('[^a-z0-9]+', '_', self.name.lower())}.png"


def draw_pictures(
    loop: Loop, health: CampaignHealth, response: IdentifiedResponse
) -> dict[str, tuple[Picture, ...]]:
    """Draw the pictures of the report.

    Where the fit before failed, only those are drawn that need none.

    Args:
        loop: the closed loop.
        health: of its campaign.
        response: of the identified model.

    Returns:
        Section to its pictures: lead_pictures, response_pictures, error_pictures, evidence_pictures,
        remainder_pictures, record_pictures, force_pictures, health_pictures.
    """
    before = loop.before if is_successful(loop.before.result) else None
    differs = loop.after is not loop.before and is_successful(loop.after.result)
    after = loop.after if differs else None
    # The two pictures that need it have a line of their own where it fails.
    telling: Slice = "damping"
    if before is not None:
        telling = or_a_line("the force", lambda: telling_slice(before, after), lambda _: telling)
    return {
        "lead_pictures": () if before is None else _lead_pictures(before, after, telling),
        "response_pictures": _response_pictures(response),
        "error_pictures": () if before is None else _error_pictures(before, after),
        "evidence_pictures": _evidence_pictures(loop),
        "remainder_pictures": _remainder_pictures(loop),
        "record_pictures": () if before is None else _record_pictures(before, after),
        "force_pictures": _force_pictures(loop.guess, before, after, telling),
        "health_pictures": () if before is None else _health_pictures(before, after, health),
    }


def _draw(
    name: str,
    caption: str,
    plot: Callable[..., Figure],
    *args: Any,
    wide: bool = False,
    size: tuple[float, float] | None = None,
    **options: Any,
) -> tuple[Picture, ...]:
    """Draw one picture, as a row of its own to join to others."""
    step(f"drawing: {name}")
    size = (_WHOLE if wide else _THIRD, _HEIGHT) if size is None else size

    def draw() -> tuple[Picture, ...]:
        ax: Axes = Figure(figsize=size, layout="constrained").add_subplot()
        return (Picture(name, caption, png_bytes(plot(*args, ax=ax, **options)), wide),)

    return _or_why_not(name, draw)


def _or_why_not(name: str, draw: Callable[[], tuple[Picture, ...]]) -> tuple[Picture, ...]:
    """Draw pictures; one without a file where that fails."""
    return or_a_line(name, draw, lambda line: (Picture(name, line, b""),))


def _lead_pictures(before: Fit, after: Fit | None, telling: Slice) -> tuple[Picture, ...]:
    """Draw what convinces: residual over the cycle, the force law, residual against the drive."""
    if any(run.record.dwells for run in before.restarts.runs):
        caption = "The worst dwell, averaged over its cycles: noise averages out, a missing force remains."
        residuals = _draw("residual over the cycle", caption, plot_cycle_residual, before, after)
    else:
        caption = "Measured minus model, where the error before is largest."
        residuals = _draw("largest residual", caption, _plot_worst, plot_residual, before, after)
    caption = "A residual that is uncorrelated with the drive stays inside the band at 99 % of the lags."
    return (
        *residuals,
        *_restoring_force(before, after, telling),
        *_draw("cross-correlation", caption, _plot_correlation, before, after, what="drive"),
    )


def _plot_worst(plot: Callable[..., Figure], before: Fit, after: Fit | None, **options: Any) -> Figure:
    """Draw a record where the error before is largest."""
    place, low, high = worst_window(before)
    return plot(before, after, record=place, window=(low, high), **options)


def _plot_correlation(before: Fit, after: Fit | None, **options: Any) -> Figure:
    """Draw the correlation of what the fits leave of the records."""
    return plot_correlation(residual(before), None if after is None else residual(after), **options)


def _restoring_force(before: Fit, after: Fit | None, what: Slice) -> tuple[Picture, ...]:
    """Draw the forces of the models over displacement or velocity."""
    caption = "Points: measured. Outside the visited range the curves extrapolate."
    name = f"force against {'displacement' if what == 'stiffness' else 'velocity'}"
    return _draw(name, caption, plot_restoring_force, before, after, what=what)


def _response_pictures(response: IdentifiedResponse) -> tuple[Picture, ...]:
    """Draw response and transmissibility of the identified model with their bands."""
    if response.bands is None:
        return ()
    size, captions = (_HALF, 1.1 * _HEIGHT), response.captions
    shown = {"measured": response.measured, "size": size}
    return (
        *_draw("response of the model", captions[0], plot_response_bands, response.bands, **shown),
        *_draw(
            "transmissibility of the model",
            captions[1],
            plot_response_bands,
            response.bands,
            what="transmissibility",
            size=size,
        ),
    )


def _error_pictures(before: Fit, after: Fit | None) -> tuple[Picture, ...]:
    """Draw the errors before and after."""
    goodness = "Segments restarted, squared error over squared noise. 1 means noise alone."
    free = "Each record simulated from start to end."
    return (
        *_draw("goodness of fit", goodness, plot_errors, before, after),
        *_draw("free-run error", free, plot_errors, before, after, measure="nrmse"),
    )


def _evidence_pictures(loop: Loop) -> tuple[Picture, ...]:
    """Draw the ranking behind each finding, or behind the verdict, and the effects by themselves."""
    caption = "Score of each absent effect, net of what a refit would absorb; χ²/dof where refitted."
    rankings = [(one.ranking, one.effect, one.indistinguishable) for one in loop.findings]
    if not rankings:
        rankings = [(loop.last.ranking, None, ())]
    pictures: list[Picture] = []
    for ranking, effect, others in rankings:
        if ranking:
            name = "ranking" if effect is None else f"ranking that found {effect}"
            options = {"effect": effect, "indistinguishable": others, "wide": True}
            size = _WHOLE, 1.3 + 0.27 * min(10, max(3, len(ranking)))
            pictures += _draw(name, caption, plot_ranking, ranking, size=size, **options)
    return (*pictures, *_or_why_not("each effect by itself", lambda: _effect_pictures(loop)))


def _remainder_pictures(loop: Loop) -> tuple[Picture, ...]:
    """Draw the unexplained residual, where there is one."""
    remainder = loop.remainder
    if remainder is None:
        return ()
    pictures: tuple[Picture, ...] = ()
    if remainder.dwells:
        caption = (
            "Rms over the noise: 1 means noise alone. Shows at which level and frequency the model fails."
        )
        pictures += _draw("map of the residual", caption, plot_remainder_map, remainder.dwells)
    caption = "Drive minus inertia minus model, averaged; a law of x and v has one value at each point."
    pictures += _draw("force residual over the plane", caption, plot_force_residual_map, remainder.force_map)
    if remainder.dwells:
        caption = "The worst dwell of the lowest, middle and highest level; grey: noise, ±2σ per harmonic."
        for against in ("displacement", "velocity"):
            pictures += _draw(
                f"force residual against {against}",
                caption,
                plot_force_residual_loops,
                remainder.dwells,
                against=against,
            )
    return pictures


def _effect_pictures(loop: Loop) -> tuple[Picture, ...]:
    lowest, highest, frequency = _motion(loop)
    pictures: tuple[Picture, ...] = ()
    for finding in loop.findings if is_successful(loop.after.result) else ():
        own = effect_on_its_own(loop.after.model, finding.effect)
        if np.any(trace_cycles(own, np.array([highest]), frequency).force):
            caption = "The force it adds around one cycle, at the smallest and the largest visited amplitude."
            pictures += _draw(
                finding.effect, caption, plot_effect, loop.after, finding.effect, (lowest, highest), frequency
            )
    return pictures


def _motion(loop: Loop) -> tuple[float, float, float]:
    """Give smallest and largest displacement amplitude [m] and a typical frequency [Hz]."""
    if loop.guess.responses:
        return *visited_amplitudes(loop.guess), centre_frequency(loop.guess)
    parts = [measured_forces(loop.before, record)[:2] for record in loop.campaign.fit_records]
    sizes = [float(np.sqrt(2.0) * np.std(x)) for x, _ in parts]
    frequencies = [float(np.std(v) / np.std(x) / (2.0 * np.pi)) for x, v in parts]
    return min(sizes), max(sizes), float(np.mean(frequencies))


def _record_pictures(before: Fit, after: Fit | None) -> tuple[Picture, ...]:
    """Draw the worst record against the models, and the residuals."""
    caption = "Free run: the record with the largest error before."
    zoomed = "The same record at the cycles with the largest error before."
    return (
        *_draw("time history", caption, plot_time_history, before, after, wide=True),
        *_draw("zoom", zoomed, _plot_worst, plot_time_history, before, after),
        *_draw("residual there", "Measured minus model.", _plot_worst, plot_residual, before, after),
        *_draw(
            "residual of each dwell",
            "1 means noise alone. A trend over frequency hints at the missing effect.",
            plot_where,
            before,
            after,
        ),
        *_draw("residual", "Whole record, one scale.", plot_residual, before, after),
        *_draw(
            "autocorrelation",
            "Fitted records; white noise stays inside the band.",
            _plot_correlation,
            before,
            after,
        ),
    )


def _force_pictures(
    guess: ClassicalGuess, before: Fit | None, after: Fit | None, telling: Slice
) -> tuple[Picture, ...]:
    """Draw the force laws of the models beside those of the classical route."""
    fits = [] if before is None else [(label, fit) for label, fit, _ in pair(before, after)]
    pictures: tuple[Picture, ...] = ()
    if guess.responses or guess.linear:
        caption = "Displacement over the measured force, by level and sweep direction."
        pictures += _draw("receptance", caption, plot_receptance, guess)
    if guess.responses and fits:
        caption = "Free resonance of the fitted model over amplitude, through the measured curves."
        pictures += _draw("backbone", caption, plot_receptance, guess, what="displacement", fits=fits)
        caption = "Models by harmonic balance; marks are the classical route, exact only for light damping."
        for what in ("stiffness", "damping"):
            pictures += _draw(f"equivalent {what}", caption, plot_equivalent, guess, fits, what=what)
    if before is not None:
        pictures += _restoring_force(before, after, "stiffness" if telling == "damping" else "damping")
    return pictures


def _health_pictures(before: Fit, after: Fit | None, health: CampaignHealth) -> tuple[Picture, ...]:
    """Draw how the stiffness scatters between records, and how the dwells lie on the model's branches."""
    pictures: tuple[Picture, ...] = ()
    if len(before.campaign.records) > 1 and np.any(before.restarts.stiffness):
        caption = "Random scatter is a property of the test; a trend in the order of the records is drift."
        pictures += _draw(
            "stiffness of each record", caption, plot_stiffness_scatter, before, after, wide=True
        )
    known = [one for one in health.dwells if not one.reason]
    if known:
        caption = "Each measured dwell on the fitted model's branch, by level; unstable above one."
        pictures += _draw("multipliers of the dwells", caption, plot_dwell_stability, known)
    if any(np.isfinite(one.nearness) for one in known):
        caption = "The fold at which the dwell's branch ends; near it a small drift changes the motion a lot."
        pictures += _draw("distance to folds", caption, plot_dwell_stability, known, what="fold")
    return pictures
