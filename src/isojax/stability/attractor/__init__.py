"""Where motions settle in time, stable or chaotic, and from where.

In: an isolator, a drive, initial states. Out: `BifurcationDiagram`, `BasinsOfAttraction`,
`PoincareSection`, `PhasePortrait`, `LyapunovExponent`, `ReturnToOrbit`. Read _stroboscope first (the motion
once a drive period, and the growth of a disturbance); every other file is one of these results and needs no
other.
"""

from ._basins import BasinsOfAttraction as BasinsOfAttraction
from ._basins import basins_of_attraction as basins_of_attraction
from ._bifurcation_diagram import BifurcationDiagram as BifurcationDiagram
from ._bifurcation_diagram import bifurcation_diagram as bifurcation_diagram
from ._lyapunov import LyapunovExponent as LyapunovExponent
from ._lyapunov import largest_lyapunov_exponent as largest_lyapunov_exponent
from ._phase_portrait import PhasePortrait as PhasePortrait
from ._phase_portrait import phase_portrait as phase_portrait
from ._poincare import PoincareSection as PoincareSection
from ._poincare import poincare_section as poincare_section
from ._return_to_orbit import ReturnToOrbit as ReturnToOrbit
from ._return_to_orbit import return_to_orbit as return_to_orbit
