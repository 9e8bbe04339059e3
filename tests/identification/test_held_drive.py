"""The effects of the drive channel where the drive jumps, and where it is the acceleration of a base."""

import dataclasses

import pytest

from isojax import rig
from isojax.elements import InputDelay, InputOffset, LinearDamping, LinearStiffness
from isojax.identification import fit, plain_unit
from isojax.models import Integrator, Isolator

PLANT = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4)))
PLAN = rig.Multisine((60.0,), 2.0, 14.0, period=2.0, periods=3)


def test_a_delay_of_a_held_drive_is_refused_and_a_fixed_one_is_not(simulated):
    campaign = simulated(PLANT, PLAN, input={"hold": "zero_order"})
    model = Isolator(800.0, (LinearStiffness(1.05e6), LinearDamping(1.1e4), InputDelay(0.0)))
    with pytest.raises(ValueError, match=r"input_delay\.delay cannot be fitted where the drive is held"):
        fit(model, campaign, integrator=Integrator())
    fit(model, campaign, integrator=Integrator(), fixed=("input_delay.delay",))


def test_the_unit_of_an_offset_is_that_of_its_channel(simulated):
    driven = simulated(PLANT, PLAN)
    based = dataclasses.replace(driven, input=dataclasses.replace(driven.input, quantity="base_acceleration"))
    declared = Isolator(1.0, (InputOffset(0.0),)).parameters[-1].spec.unit
    assert plain_unit(declared, driven) == "N"
    assert plain_unit(declared, based) == "m/s^2"
    assert plain_unit("SI unit of the output", driven) == "m/s^2"
    assert plain_unit("N/m", based) == "N/m"
