"""What force acts: one physical effect a file. This file is the catalogue: one import line an effect.

In: coefficients in SI units. Out: forces, rates of internal states, and changes of drive, mass or reading.
Read `_effect.py` (what every effect declares) and the three contracts `_force.py`, `_instrument.py` and
`_follower.py`, which `_element.py` joins in `AbstractElement`. Then read an example: `_cubic_stiffness.py` is
the shortest, `_maxwell_branch.py` has an internal state, `_sensor_gain.py` is an instrument.
"""

from .._parameters import parameter as parameter
from ._abs_quadratic_damping import AbsQuadraticDamping as AbsQuadraticDamping
from ._abs_quadratic_stiffness import AbsQuadraticStiffness as AbsQuadraticStiffness
from ._ac_coupling import AcCoupling as AcCoupling
from ._added_mass import AddedMass as AddedMass
from ._asymmetric_friction import AsymmetricFriction as AsymmetricFriction
from ._bouc_wen import BoucWen as BoucWen
from ._clipping import Clipping as Clipping
from ._clock_skew import ClockSkew as ClockSkew
from ._coulomb_friction import CoulombFriction as CoulombFriction
from ._cubic_damping import CubicDamping as CubicDamping
from ._cubic_stiffness import CubicStiffness as CubicStiffness
from ._dahl_friction import DahlFriction as DahlFriction
from ._damping_drift import DampingDrift as DampingDrift
from ._drive_harmonics import DriveHarmonics as DriveHarmonics
from ._dual_chamber import DualChamber as DualChamber
from ._element import AbstractElement as AbstractElement
from ._element import AddedHarmonic as AddedHarmonic
from ._element import Channels as Channels
from ._element import Dependence as Dependence
from ._element import Group as Group
from ._element import LookAlike as LookAlike
from ._element import Scales as Scales
from ._end_stop import EndStop as EndStop
from ._floor_motion import FloorMotion as FloorMotion
from ._fractional_damping import FractionalDamping as FractionalDamping
from ._freeplay import Freeplay as Freeplay
from ._input_delay import InputDelay as InputDelay
from ._input_gain import InputGain as InputGain
from ._input_hold import InputHold as InputHold
from ._input_offset import InputOffset as InputOffset
from ._linear_damping import LinearDamping as LinearDamping
from ._linear_stiffness import LinearStiffness as LinearStiffness
from ._lugre_friction import LugreFriction as LugreFriction
from ._mains_hum import MainsHum as MainsHum
from ._maxwell_branch import MaxwellBranch as MaxwellBranch
from ._polytropic_gas import PolytropicGas as PolytropicGas
from ._position_damping import PositionDamping as PositionDamping
from ._pressure_cubic_stiffness import PressureCubicStiffness as PressureCubicStiffness
from ._pressure_damping import PressureDamping as PressureDamping
from ._pressure_stiffness import PressureStiffness as PressureStiffness
from ._quadratic_stiffness import QuadraticStiffness as QuadraticStiffness
from ._quintic_stiffness import QuinticStiffness as QuinticStiffness
from ._second_mode import SecondMode as SecondMode
from ._sensor_gain import SensorGain as SensorGain
from ._sensor_offset import SensorOffset as SensorOffset
from ._stiffness_drift import StiffnessDrift as StiffnessDrift
from ._stribeck_friction import StribeckFriction as StribeckFriction
from ._temperature_damping import TemperatureDamping as TemperatureDamping
from ._temperature_stiffness import TemperatureStiffness as TemperatureStiffness

CATALOGUE: dict[str, type[AbstractElement]] = {
    member.name: member
    for member in tuple(globals().values())
    if isinstance(member, type) and issubclass(member, AbstractElement) and member is not AbstractElement
}
"""Every registered effect by its catalogue name."""
