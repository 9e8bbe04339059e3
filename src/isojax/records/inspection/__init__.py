"""What is in data files that nobody has described yet, and a campaign.toml drafted from it.

In: data files. Out: a `FileInspection` of each: its channels with range, rms, clipping, drift and noise
floor, its rate, and the kind of its excitation; from several of them the text of a campaign.toml.
Read `_channel.py` first, then `_guess.py` (what names and units say), `_period.py`, `_inspect_file.py`; then
`_data_files.py`, `_inertia_of_records.py`, `_arrangement.py` (levels, roles) and `_draft.py`.
"""

from ._channel import ChannelInspection as ChannelInspection
from ._data_files import find_data_files as find_data_files
from ._draft import draft_campaign as draft_campaign
from ._inspect_file import FileInspection as FileInspection
from ._inspect_file import inspect_file as inspect_file
from ._period import find_period as find_period
