"""A simulated test bench, to judge the identification by.

It stays in the package although nothing else here imports it: with it a user can simulate a planned test,
hide an effect in it, and see before the measurement whether `close_loop` would find that effect. It also
writes the demo campaign (`python -m isojax.rig.demo_campaign FOLDER`).

It shares no code with the models that it judges: NumPy and SciPy only. A `Plant` is a mass with force laws
and instruments; a `Plan` says what to test; `run` returns the records and `write_campaign` files them as a
campaign with its truth beside it.

Accuracy: with the default tolerance the motion is good to 1e-7 of its rms (tests/rig compares it with
closed forms and with SciPy). Discontinuous laws are exact: each turning, sticking and breaking away is
located and ends a step.
"""

from ._bench import DEFAULT_BENCH as DEFAULT_BENCH
from ._bench import Bench as Bench
from ._bench import SimulatedRecord as SimulatedRecord
from ._bench import response as response
from ._bench import run as run
from ._broadband_plans import FreeDecay as FreeDecay
from ._broadband_plans import Impulse as Impulse
from ._broadband_plans import Multisine as Multisine
from ._dampers import AbsQuadraticDamping as AbsQuadraticDamping
from ._dampers import CubicDamping as CubicDamping
from ._dampers import LinearDamping as LinearDamping
from ._dampers import PositionDamping as PositionDamping
from ._drift import StiffnessDrift as StiffnessDrift
from ._drive import DriveHarmonics as DriveHarmonics
from ._drive import InputHold as InputHold
from ._floor_motion import FloorMotion as FloorMotion
from ._force_pieces import Chirp as Chirp
from ._force_pieces import ForcePiece as ForcePiece
from ._force_pieces import Line as Line
from ._force_pieces import Tones as Tones
from ._friction import AsymmetricFriction as AsymmetricFriction
from ._friction import CoulombFriction as CoulombFriction
from ._friction import StribeckFriction as StribeckFriction
from ._gaps import EndStop as EndStop
from ._gaps import Freeplay as Freeplay
from ._gas import PolytropicGas as PolytropicGas
from ._hum import MainsHum as MainsHum
from ._hysteresis import BoucWen as BoucWen
from ._hysteresis import DahlFriction as DahlFriction
from ._inertial_effects import AddedMass as AddedMass
from ._inertial_effects import SecondMode as SecondMode
from ._instruments import AcCoupling as AcCoupling
from ._instruments import Clipping as Clipping
from ._instruments import ClockSkew as ClockSkew
from ._instruments import InputDelay as InputDelay
from ._instruments import InputGain as InputGain
from ._instruments import InputOffset as InputOffset
from ._instruments import Instrument as Instrument
from ._instruments import SensorGain as SensorGain
from ._instruments import SensorOffset as SensorOffset
from ._law import Law as Law
from ._law import Stretch as Stretch
from ._lugre import LugreFriction as LugreFriction
from ._paper import paper_plan as paper_plan
from ._paper import y_plant as y_plant
from ._paper import z_plant as z_plant
from ._plan import Plan as Plan
from ._plan import Trial as Trial
from ._plant import Plant as Plant
from ._plant import base_laws as base_laws
from ._pressure import AtPressure as AtPressure
from ._pressure import PressureCubicStiffness as PressureCubicStiffness
from ._pressure import PressureDamping as PressureDamping
from ._pressure import PressureStiffness as PressureStiffness
from ._relaxation import FractionalDamping as FractionalDamping
from ._relaxation import MaxwellBranch as MaxwellBranch
from ._shaker import EXAMPLE_SHAKER as EXAMPLE_SHAKER
from ._shaker import IDEAL_SHAKER as IDEAL_SHAKER
from ._shaker import Shaker as Shaker
from ._sine_plans import SteppedSine as SteppedSine
from ._sine_plans import SweptSine as SweptSine
from ._springs import AbsQuadraticStiffness as AbsQuadraticStiffness
from ._springs import CubicStiffness as CubicStiffness
from ._springs import LinearStiffness as LinearStiffness
from ._springs import QuadraticStiffness as QuadraticStiffness
from ._springs import QuinticStiffness as QuinticStiffness
from ._two_chambers import DualChamber as DualChamber
from ._write_campaign import truth as truth
from ._write_campaign import write_campaign as write_campaign
