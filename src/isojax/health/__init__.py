"""How far data and findings can be trusted: what needs the identified model and its stability both."""

from ._campaign_health import CampaignHealth as CampaignHealth
from ._campaign_health import campaign_health as campaign_health
from ._dwell_stability import REACH as REACH
from ._dwell_stability import DwellStability as DwellStability
from ._dwell_stability import dwell_stability as dwell_stability
