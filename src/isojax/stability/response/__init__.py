"""isojax.stability.response."""

from ._backbone import BackboneCurve as BackboneCurve
from ._backbone import backbone_curve as backbone_curve
from ._frequency_response import FrequencyResponse as FrequencyResponse
from ._frequency_response import frequency_response as frequency_response
from ._transmissibility import Transmissibility as Transmissibility
from ._transmissibility import transmissibility as transmissibility
