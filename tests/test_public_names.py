"""What `import isojax` lists: the journey and the namespaces; every other name is found where it lives."""

import inspect
import re
import types
from operator import attrgetter
from pathlib import Path

import pytest

import isojax as ij

FUNCTIONS = [name for name in dir(ij) if inspect.isfunction(getattr(ij, name))]
NAMESPACES = [name for name in dir(ij) if isinstance(getattr(ij, name), types.ModuleType)]
EARLIER = """
    AbstractElement Branch Campaign ClosedLoop CubicStiffness Fit InputOffset LinearDamping MaxwellBranch
    Sampled Simulation compare_filtered_receptance data_health error_table parameter_table phase_portrait
    plot_backbone plot_record plot_return plot_stability_map random_phase_multisine switch_branch write_report
"""


def test_about_thirty_names_are_listed():
    namespaces = "elements excitations identification inference models paper plot records reporting stability"
    assert namespaces.split() == NAMESPACES
    assert 30 <= len(dir(ij)) <= 40
    assert not [name for name in dir(ij) if name.startswith(("_", "plot_"))]


def test_the_journey_from_records_to_sensitivities_is_listed():
    journey = """
        read_campaign classical_guess fit residual diagnose extend close_loop paper Harmonic simulate
        load_model find_periodic_orbit stability_map continue_branch fold_curve bifurcation_diagram
        sensitivity uncertainty
    """
    assert set(journey.split()) <= set(dir(ij))


@pytest.mark.parametrize("kind", ij.elements.CATALOGUE.values(), ids=ij.elements.CATALOGUE)
def test_every_effect_stands_under_elements_and_is_found_by_its_bare_name(kind):
    assert getattr(ij.elements, kind.__name__) is kind
    assert getattr(ij, kind.__name__) is kind


@pytest.mark.parametrize("name", EARLIER.split())
def test_names_that_are_not_listed_are_found_where_they_live(name):
    assert name not in dir(ij)
    assert getattr(ij, name).__name__ == name


def test_the_catalogue_is_found_as_well():
    assert ij.CATALOGUE is ij.elements.CATALOGUE


@pytest.mark.parametrize("name", ["no_such_name", "_models_", "__wrapped__", "plot_no_such_picture"])
def test_an_unknown_name_is_an_attribute_error_that_says_it(name):
    with pytest.raises(AttributeError, match=f"module 'isojax' has no attribute '{name}'"):
        getattr(ij, name)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_a_listed_function_returns_stands_in_a_namespace_or_is_listed(name):
    kind = inspect.signature(getattr(ij, name)).return_annotation
    if isinstance(kind, type) and kind.__module__.startswith("isojax"):
        rooms = [ij, *(getattr(ij, room) for room in NAMESPACES)]
        assert any(getattr(room, kind.__name__, None) is kind for room in rooms if kind.__name__ in dir(room))


def test_every_name_that_pages_and_notebooks_use_is_there():
    root = Path(__file__).parents[1]
    pages = [*root.glob("*.md"), *root.glob("docs/**/*.md"), *root.glob("notebooks/*.ipynb")]
    text = "".join(page.read_text(encoding="utf-8") for page in pages)
    used = set(re.findall(r"\b(?:ij|isojax)\.([a-zA-Z]\w*(?:\.[a-z]\w*)?)(?=\()", text))
    assert len(used) > 20
    for chain in sorted(used):
        attrgetter(chain)(ij)
