"""Pictures of stability: they show the folds that are known, say what was not found, and label it."""

import itertools

import diffrax
import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure

import isojax as ij
from isojax.reporting import compile_seconds, map_arrays, map_summary
from isojax.stability.branch._parameter_family import family_of

FOLDS = {4.1: (190.62, 194.01), 4.2: (171.89, 178.12), 4.4: (144.52, 150.66)}
"""Lower and upper fold force [N] by frequency [Hz] of the paper's y model, found with another program."""

AMPLITUDES = np.arange(140.25, 197.0, 1.5)


@pytest.fixture(scope="module")
def model():
    return ij.paper.y_direction()


@pytest.fixture(scope="module")
def lens(model):
    return ij.stability_map(model, AMPLITUDES, list(FOLDS), coexisting=True)


@pytest.fixture(scope="module")
def branch(model):
    return ij.continue_branch(
        model, parameter="amplitude", frequency=4.2, start=160.0, stop=190.0, other_periods=()
    )


def entries(figure):
    return [text.get_text() for text in figure.axes[0].get_legend().get_texts()]


def contour_crossings(ax, frequency):
    """Amplitudes at which the contour crosses a frequency."""
    (contours,) = [c for c in ax.collections if hasattr(c, "levels")]
    found = []
    for line in contours.get_paths()[0].to_polygons(closed_only=False):
        for (x0, y0), (x1, y1) in itertools.pairwise(line):
            if x0 != x1 and min(x0, x1) <= frequency <= max(x0, x1):
                found.append(y0 + (y1 - y0) * (frequency - x0) / (x1 - x0))
    return np.unique(np.round(found, 6))


@pytest.mark.slow
def test_contour_of_the_map_passes_through_the_known_folds(lens):
    figure = ij.plot.stability_map(lens)
    spacing = AMPLITUDES[1] - AMPLITUDES[0]
    crossings = contour_crossings(figure.axes[0], 4.2)
    assert crossings.size == 2
    np.testing.assert_allclose(crossings, FOLDS[4.2], atol=spacing)
    assert entries(figure) == ["|µ| = 1", "several orbits"]
    figure.canvas.draw()


@pytest.mark.slow
def test_outline_holds_the_cells_between_the_known_folds(lens):
    between = np.stack([(low < AMPLITUDES) & (high > AMPLITUDES) for low, high in FOLDS.values()], axis=1)
    figure = ij.plot.stability_map(lens)
    (outline,) = [c for c in figure.axes[0].collections if type(c).__name__ == "LineCollection"]
    padded = np.pad(between, 1).astype(int)
    edges = np.abs(np.diff(padded, axis=0)).sum() + np.abs(np.diff(padded, axis=1)).sum()
    assert len(outline.get_segments()) == edges
    assert f"{between.sum()} with several orbits" in figure.axes[0].get_title(loc="left")


@pytest.mark.slow
def test_colours_break_at_one_where_an_orbit_is_unstable_and_end_there_where_none_is(lens):
    mesh = ij.plot.stability_map(lens).axes[0].collections[0]
    assert isinstance(mesh.norm, TwoSlopeNorm)
    assert mesh.norm.vcenter == 1.0
    below, above = mesh.cmap(mesh.norm(0.999)), mesh.cmap(mesh.norm(1.001))
    assert below[2] > 0.9
    assert above[0] > 0.9
    assert above[2] < 0.4
    lowest = ij.plot.stability_map(lens, orbit=0).axes[0].collections[0]
    assert lowest.norm.vmax == 1.0


@pytest.mark.slow
def test_map_shows_the_least_stable_or_the_asked_orbit(lens):
    shown = ij.plot.stability_map(lens).axes[0].collections[0].get_array()
    np.testing.assert_array_equal(shown, np.nanmax(np.asarray(lens.spectral_radius), axis=0))
    saddle = ij.plot.stability_map(lens, orbit=1).axes[0].collections[0].get_array()
    assert np.ma.count_masked(saddle) == np.sum(np.asarray(lens.count) == 1)
    with pytest.raises(ValueError, match="orbit"):
        ij.plot.stability_map(lens, orbit=3)


@pytest.mark.slow
def test_cells_without_an_orbit_are_grey_and_counted(lens):
    gaps = [0, 1, 2]
    failed = eqx.tree_at(
        lambda m: (m.spectral_radius, m.response, m.count),
        lens,
        (
            lens.spectral_radius.at[:, gaps, 0].set(jnp.nan),
            lens.response.at[:, gaps, 0].set(jnp.nan),
            lens.count.at[gaps, 0].set(0),
        ),
    )
    for plot in (ij.plot.stability_map, ij.plot.response_map):
        figure = plot(failed)
        assert "no orbit (3 cells)" in entries(figure)
        assert "3 without an orbit" in figure.axes[0].get_title(loc="left")
        assert np.ma.count_masked(figure.axes[0].collections[0].get_array()) == 3
        figure.canvas.draw()


@pytest.mark.slow
def test_response_map_is_in_millimetres(lens):
    shown = ij.plot.response_map(lens).axes[0].collections[0].get_array()
    np.testing.assert_allclose(shown, 1e3 * np.nanmax(np.asarray(lens.response), axis=0), rtol=1e-12)


@pytest.mark.slow
def test_branch_is_dashed_between_the_known_folds_and_marks_them(branch):
    figure = ij.plot.branch(branch)
    ax = figure.axes[0]
    solid, dashed, marks = ax.lines
    assert dashed.is_dashed()
    assert not solid.is_dashed()
    force = dashed.get_xdata()[np.isfinite(dashed.get_ydata())]
    np.testing.assert_allclose([force.min(), force.max()], FOLDS[4.2], atol=0.5)
    np.testing.assert_allclose(np.sort(marks.get_xdata()), FOLDS[4.2], atol=0.01)
    # A mark lies on the curve: the branch turns there, so the nearest points bracket it in the response.
    at = np.asarray(branch.points.response) * 1e3
    for x, y in zip(marks.get_xdata(), marks.get_ydata(), strict=True):
        place = np.argmin(np.abs(at - y))
        assert abs(np.asarray(branch.points.value)[place] - x) < 0.2
    assert entries(figure) == ["stable", "unstable", "fold"]
    assert ax.get_xlabel() == "force amplitude [N]"


@pytest.mark.slow
def test_curves_of_a_map_are_dashed_where_the_middle_orbit_of_a_fold_is(lens):
    figure = ij.plot.response_curves(lens, curves=3)
    ax = figure.axes[0]
    drawn = [float(words.removesuffix(" N")) for words in entries(figure)[:-2]]
    assert len(drawn) == 3
    assert drawn[-1] == pytest.approx(AMPLITUDES[-1], abs=0.06)
    assert entries(figure)[-2:] == ["stable", "unstable"]
    several = [(force, f) for force in drawn for f, (low, high) in FOLDS.items() if low < force < high]
    assert several
    points = {
        held: {
            (round(float(x), 6), round(float(y), 6))
            for line in ax.lines
            if line.is_dashed() != held
            for x, y in zip(line.get_xdata(), line.get_ydata(), strict=True)
        }
        for held in (True, False)
    }
    for force, frequency in several:
        place = (slice(None), int(np.argmin(np.abs(AMPLITUDES - force))), list(FOLDS).index(frequency))
        low, middle, high = ((frequency, round(1e3 * float(size), 6)) for size in lens.response[place])
        assert {low, high} <= points[True]
        assert middle in points[False]
        assert middle not in points[True]
    with pytest.raises(ValueError, match="`curves` must be a positive count"):
        ij.plot.response_curves(lens, curves=0)


@pytest.mark.slow
def test_curves_of_a_map_of_a_fit_have_the_band_of_its_cells(lens):
    """As wide as the standard errors say; none where a map of other coefficients has other orbits."""

    def drawn(error):
        errors = {"response": error, "spectral_radius": error}
        known = eqx.tree_at(lambda one: one.standard_errors, lens, errors, is_leaf=lambda one: one is None)
        return ij.plot.response_curves(known, curves=1)

    figure = drawn(0.03 * lens.response)
    assert "95 % band" in entries(figure)
    corners = np.concatenate([patch.get_path().vertices for patch in figure.axes[0].patches])
    row = int(np.argmax(np.sum(np.asarray(lens.count) > 1, axis=1)))
    for column, frequency in enumerate(FOLDS):
        sizes = np.asarray(lens.response)[:, row, column]
        ends = np.outer(sizes[np.isfinite(sizes)], [1.0 - 1.959964 * 0.03, 1.0 + 1.959964 * 0.03]).ravel()
        found = np.unique(corners[corners[:, 0] == frequency, 1].round(9))
        np.testing.assert_allclose(found, 1e3 * np.sort(ends), rtol=1e-5)
    assert "95 % band" not in entries(drawn(jnp.full_like(lens.response, jnp.nan)))


def test_every_kind_of_bifurcation_has_a_mark_of_its_own():
    from isojax.reporting.plots._stability_style import MARKS

    assert {"fold", "period_doubling", "neimark_sacker", "symmetry_breaking"} < set(MARKS)
    assert len({mark.marker for mark in MARKS.values()}) == len(MARKS)


def codimension_two(kind, along, amplitude, frequency, multipliers):
    """A special point of a curve that nobody followed."""
    good, nothing = ij.RESULTS.promote(diffrax.RESULTS.successful), jnp.array(jnp.nan)
    pair, window = jnp.zeros(2), (jnp.array([1.0, 1.0]), jnp.array([9.0, 9.0]))
    family = family_of(ij.paper.y_direction(), (nothing, nothing), window, ("amplitude", "frequency"))
    place = jnp.asarray(amplitude), jnp.asarray(frequency)
    rest = (1, False, family, ij.Integrator(), jnp.zeros(4), pair, nothing)
    return ij.CodimensionTwoPoint(kind, *place, pair, multipliers, good, along, *rest)


def test_fold_curve_shows_both_cusps():
    angle = np.linspace(0.0, 2.0 * np.pi, 9)
    cusps = tuple(
        codimension_two("cusp", "fold", a, f, jnp.ones(2) + 0j) for a, f in ((5.0, 3.0), (5.0, 5.0))
    )
    curve = ij.FoldCurve(
        jnp.asarray(5.0 + np.sin(angle)),
        jnp.asarray(4.0 - np.cos(angle)),
        jnp.zeros((9, 2)),
        jnp.ones((9, 2)) + 0j,
        cusps,
        jnp.array(True),
        1,
        True,
        ij.RESULTS.promote(diffrax.RESULTS.successful),
    )
    figure = ij.plot.fold_curve(curve, excitation="base_acceleration")
    ax = figure.axes[0]
    stars = [line for line in ax.lines if line.get_marker() == "*"]
    np.testing.assert_allclose(np.sort(stars[0].get_xdata()), [3.0, 5.0])
    assert {text.get_text() for text in ax.texts} == {"3 Hz, 5 m/s²", "5 Hz, 5 m/s²"}
    assert "m/s²" in ax.get_ylabel()
    assert entries(figure) == ["fold", "several orbits", "cusp"]


def test_curves_of_other_bifurcations_show_their_resonances():
    good = ij.RESULTS.promote(diffrax.RESULTS.successful)
    turned = jnp.exp(1j * jnp.array([[0.1, -0.1], [1.0, -1.0], [3.0, -3.0]]))
    values = jnp.array([4.0, 5.0, 6.0])
    ends = tuple(
        codimension_two(kind, "neimark_sacker", value, value, turned[0])
        for kind, value in (("resonance_1_1", values[0]), ("resonance_1_2", values[2]))
    )
    curve = ij.NeimarkSackerCurve(
        values, values, jnp.zeros((3, 2)), turned, ends, jnp.array(False), 1, False, good
    )
    figure = ij.plot.bifurcation_curve(curve)
    ax = figure.axes[0]
    np.testing.assert_allclose(ax.lines[0].get_xdata(), values)
    assert [line.get_xdata()[0] for line in ax.lines[1:3]] == [4.0, 6.0]
    assert entries(figure) == ["Neimark-Sacker", "1:1 resonance", "1:2 resonance"]
    doublings = ij.PeriodDoublingCurve(
        values, values, jnp.zeros((3, 2)), turned, (), jnp.array(True), 1, good
    )
    assert entries(ij.plot.bifurcation_curve(doublings)) == ["period doubling"]


@pytest.mark.slow
def test_phase_portrait_basins_diagram_and_return_draw_what_they_hold(model):
    drive = ij.Harmonic(amplitude=175.0, frequency=4.2)
    portrait = ij.phase_portrait(model, drive, settle=40, periods=1)
    figure = Figure()
    ax = figure.add_subplot()
    section = ij.poincare_section(model, drive, settle=40, periods=2)
    assert ij.plot.phase_portrait(portrait, section=section, ax=ax) is figure
    np.testing.assert_allclose(ax.lines[0].get_xdata(), 1e3 * np.asarray(portrait.displacement))
    assert entries(figure) == ["at 0° of the drive"]

    basins = ij.basins_of_attraction(
        model, drive, np.linspace(-2e-3, 2e-3, 5), np.linspace(-0.05, 0.05, 5), settle=60
    )
    assert basins.periods.size == 2
    figure = ij.plot.basins(basins)
    labels = entries(figure)
    assert len(labels) == 3
    assert [
        f"{100 * float(share):.1f} %" in label for share, label in zip(basins.shares, labels, strict=False)
    ]
    figure.canvas.draw()

    diagram = ij.bifurcation_diagram(
        model, [170.0, 175.0, 180.0], frequency=4.2, direction="both", settle=60, samples=4, longest=2
    )
    figure = ij.plot.bifurcation_diagram(diagram)
    up, down = figure.axes[0].lines
    assert up.get_color() != down.get_color()
    middle = np.asarray(up.get_xdata()) == 175.0
    assert np.min(np.abs(up.get_ydata()[middle] - down.get_ydata()[middle])) > 0.3
    assert entries(figure) == ["turned up", "turned down"]
    assert "period 1" in figure.axes[0].get_title(loc="left")


@pytest.mark.slow
def test_return_falls_along_the_line_of_the_multipliers(model):
    orbit = ij.find_periodic_orbit(model, ij.Harmonic(amplitude=150.0, frequency=6.0))
    figure = ij.plot.return_to_orbit(ij.return_to_orbit(model, orbit, (1e-5, 0.0), periods=20))
    distance, promised = figure.axes[0].lines
    slope = np.diff(np.log(promised.get_ydata()))
    np.testing.assert_allclose(slope, np.log(float(orbit.floquet.spectral_radius)), rtol=1e-9)
    assert figure.axes[0].get_yscale() == "log"
    assert "returned" in figure.axes[0].get_title(loc="left")
    assert distance.get_ydata().size == 21


def test_bars_of_a_power_law_are_its_exponents():
    # m^2 / k1 grows by 2 % for 1 % of the mass and falls by 1 % for 1 % of the stiffness.
    model = ij.Isolator(2.0, (ij.LinearStiffness(100.0),))
    names = ["mass", "linear_stiffness.coefficient"]
    found = ij.sensitivity(
        lambda m: {"ratio": m.mass**2 / m["linear_stiffness.coefficient"]},
        model,
        parameters=names,
        covariance=np.diag([0.02**2, 3.0**2]),
        covariance_of=names,
    )
    figure = ij.plot.sensitivity(found, "ratio", parameter_errors={"mass": 0.02, names[1]: 3.0})
    ax = figure.axes[0]
    np.testing.assert_allclose([bar.get_width() for bar in ax.patches], [2.0, -1.0], rtol=1e-12)
    assert [text.get_text() for text in ax.get_yticklabels()] == ["mass", "linear stiffness"]
    whiskers = ax.collections[0].get_segments()
    np.testing.assert_allclose([half[1, 0] - half[0, 0] for half in whiskers], [2 * 2.0, 2 * 3.0], rtol=1e-9)
    # sqrt(2^2 + 3^2) % of 0.04
    assert "0.04000 ± 0.0014" in ax.get_title(loc="left")
    with pytest.raises(ValueError, match="index"):
        ij.plot.sensitivity(found, "ratio", index=1)
    with pytest.raises(ValueError, match="quantity"):
        ij.plot.sensitivity(found, "other")


@pytest.mark.slow
def test_summary_counts_what_the_known_folds_hold(lens):
    between = np.stack([(low < AMPLITUDES) & (high > AMPLITUDES) for low, high in FOLDS.values()], axis=1)
    text = map_summary(lens, seconds={"map": (3.0, 1.0)})
    assert f"{between.sum()} cells hold several orbits, up to 3" in text
    assert "--folds draws their curve" in text
    assert f"{between.size + 2 * between.sum()} in {between.size} cells" in text
    assert "symmetric orbits only" in text
    assert "4.0 s: 3.0 s compiling, 1.0 s running" in text
    assert "not found" in text
    assert "even number" not in text


@pytest.mark.slow
def test_arrays_hold_every_number_of_the_map(lens):
    arrays = map_arrays(lens)
    for name in ("spectral_radius", "multipliers", "response", "count", "start", "split", "y0"):
        np.testing.assert_array_equal(arrays[name], np.asarray(getattr(lens, name)))
    np.testing.assert_array_equal(arrays["result"] == 0, np.isfinite(arrays["spectral_radius"]))


def test_compile_seconds_grow_with_a_compilation_and_not_with_a_run():
    import jax

    begin = compile_seconds()
    fresh = jax.jit(lambda x: jnp.sin(x) * 3.25)
    fresh(jnp.ones(7)).block_until_ready()
    after = compile_seconds()
    assert after > begin
    fresh(jnp.ones(7)).block_until_ready()
    assert compile_seconds() - after < 0.1 * (after - begin) + 1e-3


def successful(*shape):
    return jnp.zeros(shape), ij.RESULTS.promote(diffrax.RESULTS.successful)


def test_backbone_of_a_linear_spring_stands_upright():
    displacements = np.linspace(1e-3, 3e-3, 4)
    blank, result = successful(4)
    curve = ij.BackboneCurve(
        jnp.asarray(displacements),
        blank + 5.0,
        (blank + 5.0).at[0].set(jnp.nan),
        blank,
        jnp.zeros((4, 2)),
        result,
    )
    figure = ij.plot.backbone(curve)
    free, forced = figure.axes[0].lines
    np.testing.assert_array_equal(free.get_xdata(), 5.0)
    np.testing.assert_allclose(forced.get_ydata(), 1e3 * displacements)
    assert entries(figure) == ["free vibration, no damping", "phase resonance"]
    assert "not found at 1 of 4" in figure.axes[0].get_title(loc="left")


def test_transmissibility_goes_on_into_the_nearest_stable_orbit_and_closes_its_fold(lens):
    # One orbit at 1 and 4 Hz; at 2 and 3 Hz two stable ones with a saddle between.
    nan = np.nan
    size = np.array([[1.0, 1.1, 1.2, 5.0], [nan, 3.0, 2.0, nan], [nan, 4.0, 4.5, nan]])
    radius = np.where(np.arange(3)[:, None] == 1, 1.1, 0.5) * np.where(np.isnan(size), nan, 1.0)
    found = ij.Transmissibility(
        jnp.array(10.0),
        jnp.array([1.0, 2.0, 3.0, 4.0]),
        jnp.asarray(size) + 0j,
        jnp.asarray(size),
        jnp.asarray(radius),
        successful()[1],
        lens,  # of which the picture takes nothing
    )
    figure = ij.plot.transmissibility(found)
    pieces = set()
    for line in figure.axes[0].lines:
        x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
        if len(x) == 2 and np.isfinite(y).all():
            ends = sorted(zip(x.tolist(), y.round(6).tolist(), strict=True))
            pieces.add((*ends, bool(line.is_dashed())))
    assert ((1.0, 1.0), (2.0, 1.1), False) in pieces
    assert ((3.0, 4.5), (4.0, 5.0), False) in pieces
    assert ((2.0, 3.0), (2.0, 4.0), True) in pieces
    assert ((3.0, 1.2), (3.0, 2.0), True) in pieces
    assert ((2.0, 3.0), (3.0, 2.0), True) in pieces
    assert entries(figure) == ["stable", "unstable"]


@pytest.mark.slow
def test_frequency_response_marks_its_folds_where_the_curve_turns(model):
    response = ij.frequency_response(model, 150.66, (4.2, 4.6), periods=())
    figure = ij.plot.frequency_response(response)
    (marks,) = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    # At 4.4 Hz the upper fold force is 150.66 N, so one of the two folds over frequency lies there.
    assert np.min(np.abs(marks.get_xdata() - 4.4)) < 1e-3
    assert entries(figure) == ["150.7 N", "stable", "unstable", "fold"]
    phase = ij.plot.frequency_response(response, what="phase").axes[0].lines[0].get_ydata()
    assert np.nanmax(phase) < 0.0
    assert np.nanmin(phase) > -180.0
