"""How far data and findings can be trusted: what needs the identified model and its stability both.

In: a closed loop. Out: a `CampaignHealth`: unsteady dwells, repeats, noise peaks, hum, the drift budget, and
the stability of each measured dwell.
Read `_dwell_stability.py` first (each dwell beside the orbit of the model, with its largest multiplier and
the distance to the nearest fold), then `_campaign_health.py`, which collects all of it.
"""

from ._campaign_health import CampaignHealth as CampaignHealth
from ._campaign_health import campaign_health as campaign_health
from ._dwell_stability import REACH as REACH
from ._dwell_stability import DwellStability as DwellStability
from ._dwell_stability import dwell_stability as dwell_stability
