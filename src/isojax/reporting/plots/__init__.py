"""One figure a function: `plot_record(record, campaign, ax=ax)` draws on given axes, returns the Figure.

In: records, fits, residuals, maps, branches. Out: matplotlib figures; nothing is shown or saved. Read
`_style.py` and `_stability_style.py` (colours, axes, marks) first; then any file, none needs another.
`isojax.plot` offers them under short names.
"""

from ._attractor_plots import plot_basins as plot_basins
from ._attractor_plots import plot_bifurcation_diagram as plot_bifurcation_diagram
from ._attractor_plots import plot_phase_portrait as plot_phase_portrait
from ._attractor_plots import plot_return as plot_return
from ._bifurcation_curve_plots import plot_bifurcation_curve as plot_bifurcation_curve
from ._bifurcation_curve_plots import plot_fold_curve as plot_fold_curve
from ._branch_plots import plot_backbone as plot_backbone
from ._branch_plots import plot_branch as plot_branch
from ._branch_plots import plot_frequency_response as plot_frequency_response
from ._branch_plots import plot_transmissibility as plot_transmissibility
from ._classical_plots import centre_frequency as centre_frequency
from ._classical_plots import plot_equivalent as plot_equivalent
from ._classical_plots import plot_receptance as plot_receptance
from ._classical_plots import visited_amplitudes as visited_amplitudes
from ._coefficient_plots import plot_posterior as plot_posterior
from ._coefficient_plots import plot_profile as plot_profile
from ._design_plots import plot_design as plot_design
from ._design_plots import plot_next_test as plot_next_test
from ._dwell_stability_plots import plot_dwell_stability as plot_dwell_stability
from ._evidence_plots import plot_errors as plot_errors
from ._evidence_plots import plot_ranking as plot_ranking
from ._evidence_plots import plot_stiffness_scatter as plot_stiffness_scatter
from ._force_cycles import trace_cycles as trace_cycles
from ._force_plots import Slice as Slice
from ._force_plots import effect_on_its_own as effect_on_its_own
from ._force_plots import measured_forces as measured_forces
from ._force_plots import plot_effect as plot_effect
from ._force_plots import plot_restoring_force as plot_restoring_force
from ._force_plots import telling_slice as telling_slice
from ._global_sensitivity_plot import plot_global_sensitivity as plot_global_sensitivity
from ._inspection_plot import plot_inspection as plot_inspection
from ._map_plots import plot_response_map as plot_response_map
from ._map_plots import plot_stability_map as plot_stability_map
from ._obvious_picture import OBVIOUS as OBVIOUS
from ._obvious_picture import show as show
from ._record_plot import plot_record as plot_record
from ._remainder_plots import plot_force_residual_loops as plot_force_residual_loops
from ._remainder_plots import plot_force_residual_map as plot_force_residual_map
from ._remainder_plots import plot_remainder_map as plot_remainder_map
from ._residual_plots import plot_correlation as plot_correlation
from ._residual_plots import plot_cycle_residual as plot_cycle_residual
from ._residual_plots import plot_residual as plot_residual
from ._residual_plots import plot_where as plot_where
from ._response_bands_plot import median_drive as median_drive
from ._response_bands_plot import plot_response_bands as plot_response_bands
from ._response_curves_plot import plot_response_curves as plot_response_curves
from ._sensitivity_plot import plot_sensitivity as plot_sensitivity
from ._stability_style import drive_unit as drive_unit
from ._stability_style import quantity as quantity
from ._style import ROLES as ROLES
from ._style import fits_meant as fits_meant
from ._style import pair as pair
from ._time_history_plots import plot_time_history as plot_time_history
from ._time_history_plots import worst_window as worst_window
