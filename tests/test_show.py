"""Results show themselves: short, readable, in their own numbers, without computing anything.

The public namespaces say which classes there are, so that a new one without `@shown` is red.
"""

import dataclasses
import inspect
import re

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import isojax as ij
from isojax import _show, inference
from isojax._quantities import typeset_with_error
from isojax.demo import campaign_folder
from reporting.conftest import RANKING, cut

ROOMS = (
    ij.elements,
    ij.excitations,
    ij.identification,
    inference,
    ij.models,
    ij.records,
    ij.reporting,
    ij.stability,
)
INTERNAL = {"LookAlike", "Ringing", "Step", "Instant", "ContinuedLaw", "Regime", "RK4", "Rules"}
"""What declarations and integration steps hand to one another; no user holds one. `Rules` says in
signatures what differs from its defaults."""


def public_classes():
    found = {kind for room in ROOMS for kind in vars(room).values() if inspect.isclass(kind)}
    return sorted(
        (
            kind
            for kind in found
            if kind.__module__.startswith("isojax.")
            and not inspect.isabstract(kind)
            and (hasattr(kind, "_fields") or dataclasses.is_dataclass(kind))
            and kind.__name__ not in INTERNAL
        ),
        key=lambda kind: kind.__name__,
    )


def field_names(kind):
    return getattr(kind, "_fields", None) or tuple(field.name for field in dataclasses.fields(kind))


def any_value(annotation):
    """Something that a field may hold: an array of 3 along each axis, a number, a word."""
    if hasattr(annotation, "dim_str"):
        return np.full((3,) * len(annotation.dim_str.replace("*", "").split()), 1.25)
    return {float: 1.25, int: 3, str: "word", bool: True}.get(annotation)


def filled(kind):
    """An instance with some value in every field, whatever its constructor wants."""
    hints = {name: kind.__annotations__.get(name) for name in field_names(kind)}
    values = {name: any_value(annotation) for name, annotation in hints.items()}
    if hasattr(kind, "_fields"):
        return tuple.__new__(kind, values.values())
    one = object.__new__(kind)
    for name, value in values.items():
        object.__setattr__(one, name, value)
    return one


def check_text(text):
    lines = text.splitlines()
    assert 1 <= len(lines) <= 30
    assert max(map(len, lines)) <= 100, max(lines, key=len)
    assert not re.search(r"Array\(|[fic]\d+\[|<.* at 0x", text), text


@pytest.mark.parametrize("kind", public_classes(), ids=lambda kind: kind.__name__)
def test_every_public_class_shows_itself(kind):
    assert kind.__repr__ is _show._text
    check_text(repr(filled(kind)))


@pytest.mark.parametrize("kind", public_classes(), ids=lambda kind: kind.__name__)
def test_what_fields_mean_comes_from_the_docstring(kind):
    known = _show._meanings(kind)
    assert [name for name in field_names(kind) if not name.startswith("_") and name not in known] == []


@pytest.fixture(scope="module")
def results():
    """Results of the journey and of stability, small; the diagnosis is made up."""
    whole = ij.read_campaign(campaign_folder())
    chosen = [record for record in whole.records if "backward" not in record.name]
    campaign = dataclasses.replace(whole, records=tuple(cut(record, 4) for record in chosen))
    guess = ij.classical_guess(campaign)
    fit = ij.fit(guess.model, campaign)
    identification = ij.identification
    finding = identification.Finding(
        "coulomb_friction", ("dahl_friction",), 1e-9, 0.97, float("nan"), RANKING, "a test at 5 N"
    )
    verdict = identification.Verdict("found", finding, RANKING, ("bouc_wen",), 0.03, (), {}, fit, "Good.")
    extension = identification.Extension(fit, fit, verdict)
    law = identification.AlternativeLaw("x^2 v", "damping", 3e8, 2e7, "N s/m^3", -40.0, 0.97, fit.model)
    others = (identification.Alternatives(("coulomb_friction",), (law,) * 40, 137, 16.0),)
    loop = identification.Loop(
        campaign, guess, fit, (extension,), fit, "none", verdict, {}, 12.5, alternatives=others
    )
    model, drive = ij.paper.y_direction(), ij.Harmonic(amplitude=150.0, frequency=4.3)
    orbit = ij.find_periodic_orbit(model, drive)
    return {
        "loop": loop,
        "closed": ij.reporting.ClosedLoop(loop),
        "saved": fit.saved,
        "residual": ij.residual(fit),
        "budget": identification.drift_budget(fit),
        "uncertain": ij.uncertainty(fit, lambda one: one["linear_stiffness.coefficient"]),
        "orbit": orbit,
        "map": ij.stability_map(model, np.array([100.0, 175.0]), np.array([4.2, 5.0]), coexisting=True),
        "branch": ij.continue_branch(model, parameter="amplitude", frequency=4.2, start=140.0, stop=200.0),
        "response": ij.frequency_response(model, 50.0, (5.0, 6.0)),
        "transmissibility": ij.transmissibility(model, 50.0, np.array([5.0, 20.0])),
        "diagram": ij.bifurcation_diagram(model, np.array([50.0, 100.0]), frequency=3.0),
        "simulation": ij.simulate(model, drive, duration=1.0),
        "sensitivity": ij.sensitivity(orbit, parameters=["linear_damping.coefficient"]),
    }


def objects_in(one, seen):
    """Every object of isojax that a result holds."""
    if id(one) not in seen:
        seen[id(one)] = one
        shown = _show.is_shown(one)
        names = _show._field_names(one) if shown else ()
        parts = [getattr(one, name) for name in names] if names else one
        for part in parts if isinstance(parts, list | tuple) else ():
            objects_in(part, seen)
    return [part for part in seen.values() if _show.is_shown(part)]


@pytest.mark.slow
def test_every_result_and_what_it_holds_is_short_and_every_hook_works(results):
    found = objects_in(list(results.values()), {})
    names = {type(one).__name__ for one in found}
    assert {"Fit", "Campaign", "Record", "Candidate", "Orbit", "SpecialPoint"} <= names
    for one in found:
        check_text(repr(one))
        for hook in ("_headline", "_rows", "_lines"):
            if hasattr(one, hook):
                getattr(one, hook)()  # without the net of `_asked`
        assert one._repr_html_().startswith("<div><b>" + type(one).__name__)


@pytest.mark.slow
def test_to_show_computes_nothing(results):
    jax.clear_caches()
    events, computed = [], set()
    jax.monitoring.register_event_duration_secs_listener(lambda event, *_, **__: events.append(event))
    for one in objects_in(list(results.values()), {}):
        events.clear()
        repr(one)
        one._repr_html_()
        computed |= {type(one).__name__ for event in events if "compile" in event}
    assert computed == set()


@pytest.mark.slow
def test_the_numbers_shown_are_those_of_the_result(results):
    fit, orbit, smap = results["loop"].before, results["orbit"], results["map"]
    rows = {row.name: row.value for row in _show.sheet_of(fit).rows}
    for name, one in fit.parameters.items():
        assert typeset_with_error(one.value, one.standard_error, one.unit) in rows[name] or not one.fitted
    assert f"χ²/dof {fit.stats.chi2 / fit.stats.dof:.4g}" in repr(fit)
    assert f"spectral radius {float(orbit.floquet.spectral_radius):.5g}" in repr(orbit)
    for row in _show.sheet_of(orbit.model).rows:
        np.testing.assert_allclose(float(row.value.split()[0]), orbit.model[row.name], rtol=1e-4)
    drawn = [line.partition("|")[2] for line in repr(smap).splitlines() if "|" in line and "mu" not in line]
    several = np.array([[mark.isdigit() for mark in line] for line in drawn[::-1]])
    np.testing.assert_array_equal(several, np.asarray(smap.count) > 1)
    points = results["branch"].points
    assert f"{points.value.size} points, {int(points.stable.sum())} of them stable" in repr(results["branch"])


def test_traced_values_are_shown_by_their_shape():
    said = []

    @jax.jit
    def seen(model, values):
        said.append(repr(model))
        said.append(repr(ij.stability.PhasePortrait(values[:, 0], values, ij.RESULTS.successful)))
        return model.mass

    seen(ij.paper.y_direction(), jnp.ones((4, 2)))
    jax.vmap(lambda mass: said.append(repr(ij.Isolator(mass, ()))) or mass)(jnp.ones(3))
    assert "traced kg" in said[0]
    assert "traced, shape (4, 2)" in said[1]
    for text in said:
        check_text(text)


def test_a_tree_of_placeholders_can_be_shown():
    model = ij.paper.y_direction()
    for tree in (
        jax.tree.map(lambda leaf: None, model),
        jax.tree.map(lambda leaf: object(), model),
        jax.eval_shape(lambda m: m, model),
    ):
        check_text(repr(tree))


def test_a_model_shows_its_numbers_in_the_notebook():
    page = ij.paper.y_direction()._repr_html_()
    assert "1.0805e+06 N/m" in page
    assert page.count("<tr>") == 7
    assert "<script" not in dataclasses.replace(ij.records.Dwell(0, 9, 5.0, 2.0))._repr_html_()


def test_flattening_is_as_before():
    model = ij.paper.y_direction()
    leaves, tree = jax.tree.flatten(model)
    assert len(leaves) == 7
    assert eqx.tree_equal(jax.tree.unflatten(tree, leaves), model)
