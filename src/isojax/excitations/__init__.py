"""What drives the isolator: closed-form excitations and recorded ones.

In: amplitudes, frequencies and times, or the samples of a drive. Out: a function of time, with its
derivative.
Read `_excitation.py` first, then `_harmonic.py` as the shortest example; `_sampled.py` holds measured drives.
"""

from ._excitation import AbstractExcitation as AbstractExcitation
from ._harmonic import Harmonic as Harmonic
from ._multisine import Multisine as Multisine
from ._multisine import random_phase_multisine as random_phase_multisine
from ._sampled import Hold as Hold
from ._sampled import Sampled as Sampled
from ._sampled import tabulate as tabulate
from ._stepped_sine import SteppedSine as SteppedSine
from ._swept_sine import SweptSine as SweptSine
