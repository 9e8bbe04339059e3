"""What is written and printed: the report, the summary on the terminal, the files of a map.

In: a closed loop with its data health, or a stability map. Out: report.html, result.json, model.json,
tables for rich, map.npz with its pictures. Read `_summary.py` (terminal), `_result.py` (numbers),
`_pictures.py` and `_page.py` (HTML), `_or_a_line.py` (pictures that cannot be drawn), `_write.py` (which
files, whole or not at all), the two files on maps, `_inspection.py`, and `_plain.py` (files and maps as
JSON).
"""

from ._inspection import inspection_summary as inspection_summary
from ._map_files import folds_around as folds_around
from ._map_files import map_arrays as map_arrays
from ._map_files import write_map as write_map
from ._map_summary import map_summary as map_summary
from ._page import render_page as render_page
from ._plain import inspection_dict as inspection_dict
from ._plain import map_dict as map_dict
from ._png import png_bytes as png_bytes
from ._result import result_dict as result_dict
from ._summary import catalogue_table as catalogue_table
from ._summary import error_table as error_table
from ._summary import loop_summary as loop_summary
from ._summary import parameter_table as parameter_table
from ._summary import ranking_table as ranking_table
from ._summary import render_text as render_text
from ._summary import verdict_summary as verdict_summary
from ._write import fit_text as fit_text
from ._write import model_text as model_text
from ._write import write_model_files as write_model_files
from ._write import write_report as write_report
