"""What people see: pictures, tables, the report. The only floor that imports matplotlib."""

from ._classical import plot_equivalent as plot_equivalent
from ._classical import plot_receptance as plot_receptance
from ._closed_loop import ClosedLoop as ClosedLoop
from ._closed_loop import close_loop as close_loop
from ._evidence import plot_errors as plot_errors
from ._evidence import plot_ranking as plot_ranking
from ._evidence import plot_stiffness_scatter as plot_stiffness_scatter
from ._forces import plot_effect as plot_effect
from ._forces import plot_restoring_force as plot_restoring_force
from ._page import render_page as render_page
from ._record import plot_record as plot_record
from ._residuals import plot_correlation as plot_correlation
from ._residuals import plot_cycle_residual as plot_cycle_residual
from ._residuals import plot_residual as plot_residual
from ._residuals import plot_where as plot_where
from ._result import result_dict as result_dict
from ._summary import catalogue_table as catalogue_table
from ._summary import error_table as error_table
from ._summary import loop_summary as loop_summary
from ._summary import parameter_table as parameter_table
from ._summary import ranking_table as ranking_table
from ._summary import render_text as render_text
from ._summary import verdict_summary as verdict_summary
from ._time_history import plot_time_history as plot_time_history
from ._write import check_folder as check_folder
from ._write import write_report as write_report
