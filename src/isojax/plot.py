"""Every picture is a function here: `isojax.plot.record(record, campaign)` draws a record.

Each but `inspection` takes `ax=`, the axes to draw on, and makes a figure without them. It returns the
Figure, shown nowhere.
"""
# ruff: noqa: F401

from .reporting.plots import plot_backbone as backbone
from .reporting.plots import plot_basins as basins
from .reporting.plots import plot_bifurcation_curve as bifurcation_curve
from .reporting.plots import plot_bifurcation_diagram as bifurcation_diagram
from .reporting.plots import plot_branch as branch
from .reporting.plots import plot_correlation as correlation
from .reporting.plots import plot_cycle_residual as cycle_residual
from .reporting.plots import plot_design as design
from .reporting.plots import plot_dwell_stability as dwell_stability
from .reporting.plots import plot_effect as effect
from .reporting.plots import plot_equivalent as equivalent
from .reporting.plots import plot_errors as errors
from .reporting.plots import plot_fold_curve as fold_curve
from .reporting.plots import plot_force_residual_loops as force_residual_loops
from .reporting.plots import plot_force_residual_map as force_residual_map
from .reporting.plots import plot_frequency_response as frequency_response
from .reporting.plots import plot_global_sensitivity as global_sensitivity
from .reporting.plots import plot_inspection as inspection
from .reporting.plots import plot_next_test as next_test
from .reporting.plots import plot_phase_portrait as phase_portrait
from .reporting.plots import plot_posterior as posterior
from .reporting.plots import plot_profile as profile
from .reporting.plots import plot_ranking as ranking
from .reporting.plots import plot_receptance as receptance
from .reporting.plots import plot_record as record
from .reporting.plots import plot_remainder_map as remainder_map
from .reporting.plots import plot_residual as residual
from .reporting.plots import plot_response_bands as response_bands
from .reporting.plots import plot_response_curves as response_curves
from .reporting.plots import plot_response_map as response_map
from .reporting.plots import plot_restoring_force as restoring_force
from .reporting.plots import plot_return as return_to_orbit
from .reporting.plots import plot_sensitivity as sensitivity
from .reporting.plots import plot_stability_map as stability_map
from .reporting.plots import plot_stiffness_scatter as stiffness_scatter
from .reporting.plots import plot_time_history as time_history
from .reporting.plots import plot_transmissibility as transmissibility
from .reporting.plots import plot_where as where
from .reporting.plots import show as show
