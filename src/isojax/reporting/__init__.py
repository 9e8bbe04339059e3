"""What people see: pictures, tables, the report. The only floor that imports matplotlib.

In: fits, verdicts, closed loops and answers of stability. Out: figures, tables for the terminal,
report.html, result.json and model.json. Read `words` (numbers and sentences), `plots` (one figure each),
`page` (what is written), then `_closed_loop.py`, which ties the loop to its report.
"""

from ._closed_loop import ClosedLoop as ClosedLoop
from ._closed_loop import close_loop as close_loop
from ._compile_seconds import compile_seconds as compile_seconds
from .page import catalogue_table as catalogue_table
from .page import error_table as error_table
from .page import fit_text as fit_text
from .page import folds_around as folds_around
from .page import inspection_dict as inspection_dict
from .page import inspection_summary as inspection_summary
from .page import loop_summary as loop_summary
from .page import map_arrays as map_arrays
from .page import map_dict as map_dict
from .page import map_summary as map_summary
from .page import model_text as model_text
from .page import parameter_table as parameter_table
from .page import png_bytes as png_bytes
from .page import ranking_table as ranking_table
from .page import render_page as render_page
from .page import render_text as render_text
from .page import result_dict as result_dict
from .page import verdict_summary as verdict_summary
from .page import write_map as write_map
from .page import write_model_files as write_model_files
from .page import write_report as write_report
from .words import check_first_dicts as check_first_dicts
from .words import check_first_words as check_first_words
