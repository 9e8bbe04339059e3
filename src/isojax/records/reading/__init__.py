"""From campaign.toml and its data files to a `Campaign` in SI.

In: the path of a campaign.toml. Out: its checked `Declaration`, and from that the `Campaign` with its
records. Read `_declaration.py` first, then `_read_measurements.py`. It uses `_record_channels.py` (with
`_data_file.py`, `_channel_factor.py`, `_channel_units.py`, `_time_base.py`, `_resample.py`,
`_floor_channel.py`), then `_reader_filter.py`, then `_schedule.py`, `_find_dwells.py`,
`_excitation_kind.py` and `_leaks.py`.
"""

from ._channel_units import si_factor as si_factor
from ._data_file import READERS as READERS
from ._data_file import find_reader as find_reader
from ._data_file import given_columns as given_columns
from ._declaration import Declaration as Declaration
from ._declaration import read_declaration as read_declaration
from ._excitation_kind import detect_kind as detect_kind
from ._find_dwells import segment_dwells as segment_dwells
from ._read_measurements import read_measurements as read_measurements
from ._record_channels import MOST_JITTER as MOST_JITTER
from ._schedule import SCHEDULE_HEADINGS as SCHEDULE_HEADINGS
from ._time_base import RATE_TOLERANCE as RATE_TOLERANCE
