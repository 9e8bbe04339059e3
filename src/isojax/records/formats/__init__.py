"""isojax.records.formats."""

from ._csv import numbers as numbers
from ._csv import read_csv_columns as read_csv_columns
from ._csv import read_table as read_table
from ._hdf5 import read_hdf5_columns as read_hdf5_columns
from ._mat import read_mat_columns as read_mat_columns
from ._npz import read_npz_columns as read_npz_columns
from ._samples import Column as Column
from ._tdms import read_tdms_columns as read_tdms_columns
from ._universal_file import read_universal_columns as read_universal_columns
