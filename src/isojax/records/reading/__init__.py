"""isojax.records.reading."""

from ._declaration import Declaration as Declaration
from ._declaration import read_declaration as read_declaration
from ._excitation_kind import detect_kind as detect_kind
from ._find_dwells import segment_dwells as segment_dwells
from ._read_measurements import read_measurements as read_measurements
