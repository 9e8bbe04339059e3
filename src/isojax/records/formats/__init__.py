"""Readers of data files, one per format, and of data in memory.

In: a file and the names of columns, or None for all. Out: a `Column` per name, float64 samples in the file's
own unit, with the unit, rate and start time that the file states.
Read `_samples.py` first, and `_door.py` and `_limits.py`: what is refused, and how much a file may ask for.
`_time_steps.py` judges a time column, `_last_digit.py` how numbers were rounded. Tables: `_units.py`,
`_heading.py`, `_layout.py`, `_clock.py`, then `_text.py`, `_sheet.py`, `_parquet.py`, `_lvm.py`. Trees of
arrays: `_leaves.py`, then `_npz.py`, `_hdf5.py`, `_mat.py`. Both: `_in_memory.py`. Lists of channels:
`_tdms.py`, `_universal_file.py`.
"""

from ._door import door as door
from ._door import file_size as file_size
from ._hdf5 import read_hdf5_columns as read_hdf5_columns
from ._heading import split_heading as split_heading
from ._in_memory import columns_of as columns_of
from ._last_digit import last_digit as last_digit
from ._limits import LONGEST_NAME as LONGEST_NAME
from ._lvm import read_lvm_columns as read_lvm_columns
from ._mat import read_mat_columns as read_mat_columns
from ._npz import read_npz_columns as read_npz_columns
from ._parquet import read_parquet_columns as read_parquet_columns
from ._samples import Column as Column
from ._sheet import read_sheet_columns as read_sheet_columns
from ._tdms import read_tdms_columns as read_tdms_columns
from ._text import TextTable as TextTable
from ._text import read_table as read_table
from ._text import read_text_columns as read_text_columns
from ._time_steps import time_jitter as time_jitter
from ._time_steps import uniform_rate as uniform_rate
from ._units import SI_UNITS as SI_UNITS
from ._units import ChannelUnit as ChannelUnit
from ._units import channel_unit as channel_unit
from ._units import gravity_factor as gravity_factor
from ._units import one_of as one_of
from ._universal_file import read_universal_columns as read_universal_columns
