"""Maps against single orbits and the table of folds; cut, killed, resumed and spread they stay the same."""

import json
import math
import os
import socket
import subprocess
import sys

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax import (
    Harmonic,
    Isolator,
    continue_branch,
    elements,
    find_again,
    find_periodic_orbit,
    paper,
    stability_map,
)
from isojax._results import RESULTS
from isojax.stability.map._batched_newton import FOUND, NOT_CONVERGED, CellSolver, Found, blanked
from isojax.stability.map._chunks import fingerprint
from isojax.stability.map._empty_cells import Cells, without_repeats
from isojax.stability.map._starts import Candidates
from isojax.stability.map._surface import MapWindow

FORCES, BAND = np.linspace(20.0, 120.0, 9), np.linspace(4.0, 8.0, 7)


def same(one, other, *, tolerance):
    """Whether two maps hold the same orbits."""
    for name in ("spectral_radius", "multipliers", "start", "response"):
        a, b = np.asarray(getattr(one, name)), np.asarray(getattr(other, name))
        np.testing.assert_allclose(a, b, rtol=0.0, atol=tolerance, err_msg=name, equal_nan=True)
    np.testing.assert_array_equal(one.count, other.count)


@pytest.fixture(scope="module")
def small():
    """One orbit a cell."""
    return stability_map(paper.y_direction(), FORCES, BAND)


def test_cells_are_the_single_orbits_within_the_error_that_the_map_reports(small):
    assert small.error < 5e-5
    assert bool(jnp.all(small.count == 1))
    assert bool(jnp.all(jax.vmap(jax.vmap(lambda code: code == RESULTS.successful))(small.result)))
    y0 = small.y0
    for row, column in ((0, 0), (8, 0), (4, 3), (8, 6), (2, 5)):
        force, frequency = float(FORCES[row]), float(BAND[column])
        orbit = find_periodic_orbit(small.model, Harmonic(force, frequency))
        ours, single = small.multipliers[row, column], orbit.floquet.multipliers
        sums = jnp.array([ours.sum() - single.sum(), ours.prod() - single.prod()])
        assert float(jnp.max(jnp.abs(sums))) < 5e-5
        assert abs(float(small.response[row, column] / orbit.amplitude) - 1.0) < 1e-4
        swing = np.array([1.0, 2.0 * np.pi * frequency]) * float(orbit.amplitude)
        np.testing.assert_array_less(np.abs(np.asarray(y0[row, column] - orbit.y0)) / swing, 5e-5)


def test_inside_the_lens_of_folds_there_are_three_orbits_and_outside_one(lens_map):
    # Folds by the table of test_continuation: at 4.1 Hz 190.62 to 194.01 N, at 4.2 Hz 171.89 to 178.12 N, at
    # 4.4 Hz 144.52 to 150.66 N; rows 120, 148, 150, 160, 175, 192.5, 210 N,
    # columns 4.1, 4.2, 4.4, 4.8 Hz.
    expected = np.ones((7, 4), int)
    for cell in ((1, 2), (2, 2), (4, 1), (5, 0)):
        expected[cell] = 3
    np.testing.assert_array_equal(lens_map.count, expected)
    inside = lens_map.spectral_radius[:, 4, 1]
    assert float(inside[1]) > 1.0 > max(float(inside[0]), float(inside[2]))
    assert bool(jnp.all(jnp.diff(lens_map.response[:, 4, 1]) > 0.0))
    assert bool(jnp.all(jnp.isnan(lens_map.spectral_radius[1:, 0, 0])))
    assert not bool(lens_map.stable[1, 0, 0])


def test_no_orbit_in_or_beside_the_lens_is_further_off_than_the_reported_error():
    smap = stability_map(
        paper.y_direction(), np.linspace(140.0, 200.0, 61), np.linspace(4.0, 4.5, 41), coexisting=True
    )
    count, random = np.asarray(smap.count), np.random.default_rng(5)
    assert set(np.unique(count)) == {1, 3}
    y0, multipliers = np.asarray(smap.y0), np.asarray(smap.multipliers)
    for orbits, most in ((3, 2e-5), (1, 2e-6)):
        for row, column in random.permutation(np.argwhere(count == orbits))[:6]:
            drive = Harmonic(float(smap.amplitudes[row]), float(smap.frequencies[column]))
            for own in range(orbits):
                start = jnp.asarray(y0[own, row, column])
                exact = find_periodic_orbit(smap.model, drive, start=start, symmetric=True)
                np.testing.assert_allclose(smap.response[own, row, column], exact.amplitude, rtol=1e-4)
                ours, theirs = multipliers[own, row, column], np.asarray(exact.floquet.multipliers)
                # The characteristic polynomial over its slope, as the map's error is defined.
                polynomial = np.abs((ours[:, None] - theirs[None]).prod(axis=1))
                error = np.max(polynomial / np.maximum(np.abs(theirs[0] - theirs[1]), 0.1))
                assert error <= min(smap.error, most)


def test_orbits_hide_neither_in_a_narrow_dip_of_the_force_nor_next_to_a_fold():
    # At resonance a lightly damped mount needs a small part of the force that it needs to either side.
    laws = elements.LinearStiffness(3e5), elements.CubicStiffness(4e10), elements.LinearDamping(60.0)
    model = Isolator(120.0, laws)
    axis = dict(parameter="amplitude", start=1.0, stop=80.0, other_periods=())
    for frequency in (8.5, 9.0):
        folds = continue_branch(model, frequency=frequency, **axis).special_points
        low, high = sorted(float(fold.amplitude) for fold in folds)
        assert low < 0.2 * high
        rows = [(1.0 - 1e-5) * low, (1.0 + 1e-5) * low, (1.0 - 1e-5) * high, (1.0 + 1e-5) * high]
        for forces, counts in ((rows, [1, 3, 3, 1]), (rows[:2], [1, 3]), ([1e-4, rows[2]], [1, 3])):
            smap = stability_map(model, forces, [frequency, 12.0], coexisting=True)
            np.testing.assert_array_equal(smap.count[:, 0], counts)


def test_cells_that_cannot_be_read_off_are_solved_for_themselves():
    # An internal state gives a third multiplier, which no trace and determinant hold. It forgets so fast that
    # the usual 128 steps a period overflow, also where the cells are found again.
    law = (elements.LinearStiffness(1.0), elements.LinearDamping(0.1), elements.MaxwellBranch(60.0, 0.003))
    smap = stability_map(Isolator(1.0, law), [0.5, 1.0], [0.1, 0.17])
    # As single orbits, as where orbits share no order of kinks.
    apart = eqx.tree_at(lambda one: one.split, smap, jnp.zeros_like(smap.split))
    again = find_again(apart, smap.model)
    for row, column in np.ndindex(2, 2):
        force, frequency = float(smap.amplitudes[row]), float(smap.frequencies[column])
        # s x / (s + 1 / tau) is what the spring of the branch is stretched by.
        rates = np.array([[0.0, 1.0, 0.0], [-1.0, -0.1, -60.0], [0.0, 1.0, -1.0 / 0.003]])
        exact = np.sort_complex(np.exp(np.linalg.eigvals(rates) / frequency))
        turn = 2j * np.pi * frequency
        size = abs(force / (turn**2 + 0.1 * turn + 1.0 + 60.0 * turn / (turn + 1.0 / 0.003)))
        for found in (smap, again):
            roots = np.sort_complex(np.asarray(found.multipliers[row, column]))
            np.testing.assert_allclose(roots, exact, atol=smap.error + 1e-9)
            np.testing.assert_allclose(found.response[row, column], size, rtol=1e-6)


def test_orbits_of_the_sample_that_finer_steps_do_not_find_are_counted_and_not_kept(small, monkeypatch):
    improve = CellSolver.improve

    def loses_one(self, method, lanes, count, limit=None):
        found = improve(self, method, lanes, count, limit)
        return found if limit is None else blanked(found, np.array([0]), NOT_CONVERGED)

    monkeypatch.setattr(CellSolver, "improve", loses_one)
    smap = stability_map(small.model, FORCES, BAND)
    assert smap.unconfirmed == 1
    assert "finer steps did not find 1 of the sampled orbits" in repr(smap)
    row, column = np.argwhere(~np.asarray(smap.split))[0]
    # Left empty it would count as not accurate; a single orbit, split for itself, is found in its place.
    exact = find_periodic_orbit(smap.model, Harmonic(float(FORCES[row]), float(BAND[column])))
    found = np.asarray(smap.multipliers[row, column])
    np.testing.assert_allclose(found, np.asarray(exact.floquet.multipliers), atol=1e-9)
    assert small.unconfirmed == 0


def test_the_size_of_an_offset_motion_is_half_its_whole_range():
    law = (elements.LinearStiffness(1.0), elements.LinearDamping(0.05), elements.QuadraticStiffness(0.2))
    smap = stability_map(Isolator(1.0, law), [0.05, 0.1, 0.2], [0.06, 0.1, 0.2])
    for row, column in np.ndindex(3, 3):
        drive = Harmonic(float(smap.amplitudes[row]), float(smap.frequencies[column]))
        exact = find_periodic_orbit(smap.model, drive)
        np.testing.assert_allclose(smap.response[row, column], exact.amplitude, rtol=1e-5)


def test_without_coexisting_the_smallest_motion_is_given(lens_map):
    plain = stability_map(lens_map.model, lens_map.amplitudes, lens_map.frequencies)
    np.testing.assert_allclose(plain.spectral_radius, lens_map.spectral_radius[0], atol=1e-12)
    same(plain, lens_map.smallest(), tolerance=1e-12)


def test_a_killed_run_goes_on_and_ends_with_the_very_same_numbers(tmp_path):
    class Killed(Exception):
        """Stands for the end of the process."""

    many = np.linspace(20.0, 120.0, 1500)
    arguments = {"chunk": 1024}
    whole = stability_map(paper.y_direction(), many, BAND, **arguments)

    def stop(line):
        if line.startswith("2048 of"):
            raise Killed

    with pytest.raises(Killed):
        stability_map(paper.y_direction(), many, BAND, checkpoint=tmp_path, progress=stop, **arguments)
    stamps = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.npz")}
    resumed = stability_map(paper.y_direction(), many, BAND, checkpoint=tmp_path, **arguments)
    after = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.npz")}
    # Some chunks were done when it was killed, others not; the former were not done again.
    assert 2 <= len(stamps) < len(after)
    assert {name: after[name] for name in stamps} == stamps
    same(resumed, whole, tolerance=0.0)
    damaged = tmp_path / min(stamps)
    kept = damaged.read_bytes()
    damaged.write_bytes(kept[:100])
    with pytest.raises(ValueError, match=f"{damaged.name} is damaged"):
        stability_map(paper.y_direction(), many, BAND, checkpoint=tmp_path, **arguments)
    damaged.write_bytes((tmp_path / max(stamps)).read_bytes())
    with pytest.raises(ValueError, match=f"{damaged.name} holds other cells"):
        stability_map(paper.y_direction(), many, BAND, checkpoint=tmp_path, **arguments)
    damaged.write_bytes(kept)
    with pytest.raises(
        ValueError, match=f"must name a folder, but a file is in the place of .*{damaged.name}"
    ):
        stability_map(paper.y_direction(), many, BAND, checkpoint=damaged, **arguments)
    with pytest.raises(ValueError, match="which holds the chunks of another map"):
        stability_map(paper.y_direction(), 1.01 * many, BAND, checkpoint=tmp_path, **arguments)
    other = paper.y_direction().replace(mass=801.0)
    with pytest.raises(ValueError, match="which holds the chunks of another map"):
        stability_map(other, many, BAND, checkpoint=tmp_path, **arguments)
    label = tmp_path / "map.json"
    older = json.loads(label.read_text(encoding="utf-8"))
    label.write_text(json.dumps(older | {"code": "0"}), encoding="utf-8")
    with pytest.raises(ValueError, match="chunks that other code computed"):
        stability_map(paper.y_direction(), many, BAND, checkpoint=tmp_path, **arguments)
    label.write_text("{", encoding="utf-8")
    with pytest.raises(ValueError, match=r"map\.json is damaged"):
        stability_map(paper.y_direction(), many, BAND, checkpoint=tmp_path, **arguments)


def test_the_size_of_the_chunks_changes_no_number():
    many = np.linspace(20.0, 120.0, 300)
    small, large = (stability_map(paper.y_direction(), many, BAND, chunk=chunk) for chunk in (1024, 4096))
    same(small, large, tolerance=1e-12)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"amplitudes": [1.0, -2.0]}, "Argument `amplitudes` must be positive, but amplitudes[1] = -2.0."),
        ({"amplitudes": []}, "Argument `amplitudes` must be a list of numbers, but has shape (0,)."),
        (
            {"frequencies": [4.0, 4.0]},
            "Argument `frequencies` must ascend, but frequencies[1] = 4.0 follows 4.0.",
        ),
        ({"frequencies": [np.nan]}, "Argument `frequencies` must be positive, but frequencies[0] = nan."),
        (
            {"amplitudes": ["1", "2"]},
            "Argument `amplitudes` must be a list of real numbers, but is ['1', '2'].",
        ),
        ({"amplitudes": [True]}, "Argument `amplitudes` must be a list of real numbers, but is [True]."),
        ({"amplitudes": ["a"]}, "Argument `amplitudes` must be a list of real numbers, but is ['a']."),
        ({"amplitudes": [1j]}, "Argument `amplitudes` must be a list of real numbers, but is [1j]."),
        (
            {"model": paper.y_direction().replace(k1=math.nan)},
            "Argument `model` must hold finite numbers, but linear_stiffness.coefficient is nan.",
        ),
        *(
            (
                {"devices": given},
                "Argument `devices` must list devices of JAX, such as jax.local_devices()[:1], "
                f"but is {given!r}.",
            )
            for given in ([], "cpu", 3)
        ),
        ({"chunk": 0}, "Argument `chunk` must be a positive count, but is 0."),
    ],
)
def test_bad_arguments_are_refused_with_what_was_expected(arguments, words):
    default = {"model": paper.y_direction(), "amplitudes": [1.0, 2.0], "frequencies": [4.0, 5.0]}
    with pytest.raises(ValueError, match="Argument") as caught:
        stability_map(**{**default, **arguments})
    assert str(caught.value) == words


@pytest.mark.parametrize("name", ["amplitudes", "frequencies"])
@pytest.mark.parametrize("transformed", [jax.jit, jax.vmap, jax.jacfwd])
def test_a_map_of_traced_axes_says_what_to_use(name, transformed):
    model, axes = paper.y_direction(), {"amplitudes": FORCES, "frequencies": BAND}

    def radius(axis):
        return stability_map(model, **(axes | {name: axis})).spectral_radius

    given = jnp.asarray(axes[name])
    with pytest.raises(ValueError, match=rf"Argument `{name}` must hold plain .*find_again\(orbit, model"):
        transformed(radius)(given[None] if transformed is jax.vmap else given)


SCRIPT = """
import sys
import equinox as eqx
import jax
jax.config.update("jax_enable_x64", True)
if len(sys.argv) > 2:
    jax.distributed.initialize(sys.argv[2], num_processes=2, process_id=int(sys.argv[3]))
import numpy as np
from isojax import paper, stability_map
smap = stability_map(paper.y_direction(), np.linspace(20.0, 120.0, 300), np.linspace(4.0, 8.0, 7), chunk=1024)
print(len(jax.local_devices()), jax.process_count())
names = ("spectral_radius", "start", "response", "count")
np.savez(sys.argv[1], **{name: np.asarray(getattr(smap, name)) for name in names})
"""


def elsewhere(arguments, flags=""):
    """Start the map in an interpreter of its own."""
    # Beside the flags of this process, so that it compiles as quickly.
    flags = f"{os.environ.get('XLA_FLAGS', '')} {flags}".strip()
    environment = {**os.environ, "JAX_PLATFORMS": "cpu", "XLA_FLAGS": flags}
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT, *map(str, arguments)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finished(process):
    """Wait for it and give what it printed."""
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    # The last line; before it the transport between processes may have printed its own.
    return out.splitlines()[-1].split()


@pytest.fixture(scope="module")
def alone():
    """The map on one device of one process."""
    return stability_map(paper.y_direction(), np.linspace(20.0, 120.0, 300), BAND, chunk=1024)


def assert_same_as(file, alone):
    with np.load(file) as numbers:
        for name in numbers.files:
            np.testing.assert_allclose(
                numbers[name], getattr(alone, name), rtol=0.0, atol=1e-12, err_msg=name
            )


@pytest.mark.slow
def test_two_devices_give_the_numbers_of_one(tmp_path, alone):
    process = elsewhere([tmp_path / "map.npz"], "--xla_force_host_platform_device_count=2")
    assert finished(process) == ["2", "1"]
    assert_same_as(tmp_path / "map.npz", alone)


@pytest.mark.slow
def test_two_processes_give_the_numbers_of_one(tmp_path, alone):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    processes = [elsewhere([tmp_path / f"map{own}.npz", address, own]) for own in range(2)]
    for own, process in enumerate(processes):
        assert finished(process) == ["1", "2"]
        assert_same_as(tmp_path / f"map{own}.npz", alone)


def test_of_starts_that_led_to_one_orbit_one_is_left(small):
    # Rounding of their sizes puts the three in any order; a fourth has the same size, but another state.
    cell = small.start[4, 3], small.direction[4, 3], small.phases[4, 3], small.multipliers[4, 3]
    turned = cell[0] * np.array([1.0, -1.0]) + np.array([0.0, 1e-3])
    rows = [[cell[0], cell[0], cell[0], turned], *([own] * 4 for own in cell[1:])]
    sizes = float(small.response[4, 3]) * (1.0 + 1e-15 * np.array([0.0, 4.0, 2.0, 0.0]))
    found = Found(*(np.stack(own) for own in rows), np.ones(4), sizes, np.full(4, FOUND, np.int8))
    column, row, order = np.full(4, 3), np.full(4, 4), np.arange(4)
    cells = Cells(Candidates(row, column, column, order), found, np.zeros(4, bool))
    window = MapWindow(FORCES, BAND)
    left = without_repeats(small.model, small.integrator, True, window, cells)
    np.testing.assert_array_equal(left.found.code == FOUND, [True, False, False, True])
    np.testing.assert_array_equal(np.isnan(left.found.response), [False, True, True, False])


def test_where_one_axis_ends_belongs_to_the_name_of_a_checkpoint():
    assert fingerprint(np.arange(2.0), np.arange(2.0, 5.0)) != fingerprint(
        np.arange(3.0), np.arange(3.0, 5.0)
    )
    assert fingerprint(np.arange(2.0)) == fingerprint(np.arange(2.0))


def test_an_even_count_of_orbits_is_printed_as_one_that_lacks_some(lens_map):
    assert "even" not in repr(lens_map)
    lacking = eqx.tree_at(lambda smap: smap.count, lens_map, lens_map.count.at[0, 1].set(2))
    assert "1 with an even count of them" in " ".join(repr(lacking).split())
    assert "1 cells hold an even number of orbits: folds come in pairs" in repr(lacking)


def test_other_places_of_rest_are_named_in_millimetres():
    laws = elements.LinearStiffness(1e6), elements.CubicStiffness(-1e11), elements.LinearDamping(1e4)
    smap = stability_map(Isolator(800.0, laws), [50.0, 60.0], [4.0, 5.0])
    np.testing.assert_allclose(smap.other_rests, [-1e-5 * math.sqrt(1e5), 1e-5 * math.sqrt(1e5)], rtol=1e-4)
    assert "without a drive the mass also rests at -3.16, 3.16 mm" in repr(smap)
