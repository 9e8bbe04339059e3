"""The one picture that each result asks for first: `result.plot()`, or `isojax.plot.show(result)`."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...identification import (
    ClassicalGuess,
    Extension,
    Finding,
    Fit,
    ForceMap,
    Loop,
    NextTest,
    Remainder,
    Residual,
    Verdict,
)
from ...inference import Design, GlobalSensitivity, Posterior, Profile
from ...models import Simulation
from ...records import Campaign
from ...stability import (
    BackboneCurve,
    BasinsOfAttraction,
    BifurcationDiagram,
    Branch,
    FoldCurve,
    FrequencyResponse,
    NeimarkSackerCurve,
    Orbit,
    PeriodDoublingCurve,
    PhasePortrait,
    ResponseBands,
    ReturnToOrbit,
    Sensitivity,
    StabilityMap,
    Transmissibility,
)
from ._attractor_plots import plot_basins, plot_bifurcation_diagram, plot_phase_portrait, plot_return
from ._bifurcation_curve_plots import plot_bifurcation_curve, plot_fold_curve
from ._branch_plots import plot_backbone, plot_branch, plot_frequency_response, plot_transmissibility
from ._classical_plots import plot_receptance
from ._coefficient_plots import plot_posterior, plot_profile
from ._design_plots import plot_design, plot_next_test
from ._evidence_plots import plot_ranking
from ._global_sensitivity_plot import plot_global_sensitivity
from ._map_plots import plot_stability_map
from ._record_plot import plot_record
from ._remainder_plots import plot_force_residual_map, plot_remainder_map
from ._residual_plots import plot_correlation
from ._response_bands_plot import plot_response_bands
from ._sensitivity_plot import plot_sensitivity
from ._style import AFTER, axes_for
from ._time_history_plots import plot_time_history


def _orbit(orbit: Orbit, *, ax: Axes | None = None) -> Figure:
    """Draw the orbit over displacement and velocity."""
    return plot_phase_portrait(PhasePortrait(orbit.time, orbit.states, orbit.result), ax=ax)


def _simulation(simulation: Simulation, *, ax: Axes | None = None) -> Figure:
    """Draw the displacement over time."""
    figure, ax = axes_for(ax)
    ax.plot(
        np.asarray(simulation.time), 1e3 * np.asarray(simulation.displacement), color=AFTER, linewidth=0.9
    )
    ax.set_xlabel("time [s]")
    ax.set_ylabel("displacement [mm]")
    return figure


def _remainder(remainder: Remainder, *, ax: Axes | None = None) -> Figure:
    """Draw where dwells are not explained; without dwells, over which motion."""
    if remainder.dwells:
        return plot_remainder_map(remainder.dwells, ax=ax)
    return plot_force_residual_map(remainder.force_map, ax=ax)


def _record(campaign: Campaign, *, record: int = 0, **options: Any) -> Figure:
    """Draw a record of a campaign, the first if none is named."""
    return plot_record(campaign.records[record], campaign, **options)


def _sensitivity(sensitivity: Sensitivity, quantity: str = "", **options: Any) -> Figure:
    """Draw the sensitivity of a quantity, the first that is one number if none is named."""
    single = (name for name, value in sensitivity.values.items() if np.ndim(value) == 0)
    return plot_sensitivity(sensitivity, quantity or next(single, ""), **options)


OBVIOUS: dict[type, Callable[..., Figure]] = {
    BackboneCurve: plot_backbone,
    BasinsOfAttraction: plot_basins,
    BifurcationDiagram: plot_bifurcation_diagram,
    Branch: plot_branch,
    Campaign: _record,
    ClassicalGuess: plot_receptance,
    Design: plot_design,
    Extension: plot_time_history,
    Finding: plot_ranking,
    Fit: plot_time_history,
    FoldCurve: plot_fold_curve,
    ForceMap: plot_force_residual_map,
    FrequencyResponse: plot_frequency_response,
    GlobalSensitivity: plot_global_sensitivity,
    Loop: plot_time_history,
    NeimarkSackerCurve: plot_bifurcation_curve,
    NextTest: plot_next_test,
    Orbit: _orbit,
    PeriodDoublingCurve: plot_bifurcation_curve,
    PhasePortrait: plot_phase_portrait,
    Posterior: plot_posterior,
    Profile: plot_profile,
    Remainder: _remainder,
    Residual: plot_correlation,
    ResponseBands: plot_response_bands,
    ReturnToOrbit: plot_return,
    Sensitivity: _sensitivity,
    Simulation: _simulation,
    StabilityMap: plot_stability_map,
    Transmissibility: plot_transmissibility,
    Verdict: plot_ranking,
}
"""What draws each kind of result. A result that is not here has no picture that goes without saying."""


def show(result: Any, **options: Any) -> Figure:
    """Draw the one picture that a result asks for first.

    Args:
        result: such as a fit, a diagnosis, an orbit or a map.
        **options: of the function that draws it, such as `ax`, the axes to draw on.

    Returns:
        The figure, shown nowhere.

    Raises:
        ValueError: if the result has no such picture.
    """
    draw = OBVIOUS.get(type(result))
    if draw is None:
        known = ", ".join(sorted(kind.__name__ for kind in OBVIOUS))
        raise ValueError(f"Argument `result` must be one of {known}, but is a {type(result).__name__}.")
    return draw(result, **options)


# A fit cannot draw itself: its room lies below this one, the only one that imports matplotlib. So the method
# is given to the classes from here, once, when the package is imported; no lower file names a picture.
for _kind, _draw in OBVIOUS.items():
    _kind.plot = _draw  # pyright: ignore[reportAttributeAccessIssue]
