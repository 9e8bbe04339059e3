"""The advice on which test parts look-alikes."""

import itertools

import pytest

from isojax.elements import CATALOGUE
from isojax.identification.diagnosis._separating_words import is_exact, separating_experiment


def test_a_pair_of_look_alikes_is_declared_once_and_of_effects_of_the_catalogue():
    pairs = [
        {one, other}
        for name, kind in CATALOGUE.items()
        for alike in kind.look_alikes
        for one, other in itertools.combinations((name, *alike.others), 2)
        if alike.separates(name, {one, other})
    ]
    assert pairs
    assert all(len(pair) == 2 and pair <= set(CATALOGUE) for pair in pairs)
    assert all(pairs.count(pair) == 1 for pair in pairs)


def test_a_gap_and_a_stop_are_one_law_beside_a_free_linear_spring_alone():
    assert is_exact("freeplay", "end_stop", {"linear_stiffness", "linear_damping"})
    assert is_exact("end_stop", "freeplay", {"linear_stiffness"})
    assert not is_exact("freeplay", "end_stop", {"linear_damping"})
    assert not is_exact("coulomb_friction", "dahl_friction", {"linear_stiffness"})


@pytest.mark.parametrize(
    ("effect", "others", "test"),
    [
        ("added_mass", ("input_gain",), "known extra mass"),
        ("maxwell_branch", ("input_delay",), "twice the resonance"),
        ("lugre_friction", ("dahl_friction",), "a third of the lowest level"),
        ("dual_chamber", ("maxwell_branch",), "three times the level"),
        ("fractional_damping", ("maxwell_branch",), "more than a decade"),
        ("second_mode", ("added_mass",), "upwards"),
        ("ac_coupling", ("input_delay",), "downwards"),
        ("end_stop", ("clipping",), "range of the response channel"),
        ("end_stop", ("freeplay",), "the same records"),
        ("asymmetric_friction", ("input_offset",), "exciter uncoupled"),
        ("polytropic_gas", ("quadratic_stiffness",), "three times the top level"),
        ("input_gain", ("sensor_gain",), "alibrate either channel"),
    ],
)
def test_look_alikes_come_with_the_test_that_parts_them(effect, others, test):
    assert test in separating_experiment(effect, others)
    assert test in separating_experiment(others[0], (effect,))


def test_a_relaxation_and_a_mass_without_a_delay_need_no_test_of_delays():
    assert "delay" not in separating_experiment("maxwell_branch", ("added_mass",))


def test_an_extra_mass_is_no_advice_between_two_gains():
    assert "extra mass" not in separating_experiment("input_gain", ("sensor_gain",))


def test_unknown_pairs_are_told_apart_by_level_and_nothing_needs_parting_alone():
    assert "three lower" in separating_experiment("cubic_stiffness", ("clipping",))
    assert separating_experiment("cubic_stiffness", ()) == ""
