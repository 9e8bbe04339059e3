"""Readers of data files, one per format.

In: a file and the names of columns. Out: a `Column` per name, float64 samples in the file's own unit, with
the rate and start time that the file states.
Read `_samples.py` first, then `_csv.py`; `_npz.py`, `_hdf5.py`, `_mat.py`, `_tdms.py` and
`_universal_file.py` do the same for their formats.
"""

from ._csv import numbers as numbers
from ._csv import read_csv_columns as read_csv_columns
from ._csv import read_table as read_table
from ._hdf5 import read_hdf5_columns as read_hdf5_columns
from ._mat import read_mat_columns as read_mat_columns
from ._npz import read_npz_columns as read_npz_columns
from ._samples import Column as Column
from ._tdms import read_tdms_columns as read_tdms_columns
from ._universal_file import read_universal_columns as read_universal_columns
