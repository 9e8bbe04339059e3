"""Curves over frequency or amplitude that a designer reads.

In: an isolator, a drive amplitude or displacements. Out: `FrequencyResponse` past its folds, `Resonance` (its
largest point), `BackboneCurve` (free vibration and phase resonance), `Transmissibility`; `ResponseBands` (all
of a fitted model at several amplitudes, with bands, for a picture). Read _frequency_response (a branch over
frequency), _resonance, _free_vibration and _backbone, _transmissibility, _imposed_motion (orbits over
displacement and frequency) and _response_bands (read off them). Orbits of the others come from the rooms
branch and map.
"""

from ._backbone import BackboneCurve as BackboneCurve
from ._backbone import backbone_curve as backbone_curve
from ._frequency_response import FrequencyResponse as FrequencyResponse
from ._frequency_response import frequency_response as frequency_response
from ._resonance import Resonance as Resonance
from ._resonance import find_resonance as find_resonance
from ._resonance import resonance_again as resonance_again
from ._response_bands import CurveFold as CurveFold
from ._response_bands import ResponseBands as ResponseBands
from ._response_bands import ResponseCurve as ResponseCurve
from ._response_bands import response_bands as response_bands
from ._transmissibility import Transmissibility as Transmissibility
from ._transmissibility import transmissibility as transmissibility
from ._transmissibility import transmissibility_again as transmissibility_again
