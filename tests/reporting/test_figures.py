import dataclasses
import inspect
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import isojax
from isojax.identification import residual
from isojax.reporting import plots


def pairs(loop):
    return [("before", loop.before), ("after", loop.after)]


PLOTS = {
    "record": lambda loop, ax: isojax.plot.record(loop.campaign.records[0], loop.campaign, ax=ax),
    "time_history": lambda loop, ax: isojax.plot.time_history(loop.before, loop.after, ax=ax),
    "residual": lambda loop, ax: isojax.plot.residual(loop.before, loop.after, ax=ax),
    "cycle_residual": lambda loop, ax: isojax.plot.cycle_residual(loop.before, loop.after, ax=ax),
    "where": lambda loop, ax: isojax.plot.where(loop.before, loop.after, ax=ax),
    "correlation": lambda loop, ax: isojax.plot.correlation(
        residual(loop.before), residual(loop.after), ax=ax
    ),
    "receptance": lambda loop, ax: isojax.plot.receptance(loop.guess, ax=ax),
    "backbone": lambda loop, ax: isojax.plot.receptance(
        loop.guess, what="displacement", fits=pairs(loop), ax=ax
    ),
    "stiffness": lambda loop, ax: isojax.plot.equivalent(loop.guess, pairs(loop), ax=ax),
    "damping": lambda loop, ax: isojax.plot.equivalent(loop.guess, pairs(loop), what="damping", ax=ax),
    "restoring_force": lambda loop, ax: isojax.plot.restoring_force(loop.before, loop.after, ax=ax),
    "effect": lambda loop, ax: isojax.plot.effect(loop.after, "coulomb_friction", (1e-4, 1e-3), 5.0, ax=ax),
    "ranking": lambda loop, ax: isojax.plot.ranking(
        loop.findings[0].ranking, effect="coulomb_friction", indistinguishable=("dahl_friction",), ax=ax
    ),
    "errors": lambda loop, ax: isojax.plot.errors(loop.before, loop.after, ax=ax),
    "stiffness_scatter": lambda loop, ax: isojax.plot.stiffness_scatter(loop.before, loop.after, ax=ax),
}


@pytest.mark.parametrize("name", PLOTS)
def test_every_plot_draws_on_the_axes_it_is_given_and_labels_them(found, name):
    figure = Figure()
    ax = figure.add_subplot()
    assert PLOTS[name](found, ax) is figure
    assert ax.get_xlabel() or name == "errors"
    assert ax.get_ylabel() or name == "ranking"
    assert ax.lines or ax.collections or ax.patches
    figure.canvas.draw()
    legend = ax.get_legend()
    assert legend is None or not ax.bbox.padded(-1.0).overlaps(legend.get_window_extent())


@pytest.mark.parametrize("name", ["time_history", "restoring_force", "errors"])
def test_a_plot_without_axes_makes_its_own_figure(found, name):
    figure = PLOTS[name](found, None)
    assert isinstance(figure, Figure)
    assert len(figure.axes) == 1


def test_curves_show_what_was_measured_and_simulated(found):
    figure = isojax.plot.time_history(found.before, found.after, record=2, window=(1.0, 2.0))
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    record = found.campaign.records[2]
    shown = (record.time >= 1.0) & (record.time <= 2.0)
    np.testing.assert_array_equal(lines["measured"], record.output[shown])
    np.testing.assert_array_equal(lines["after"], found.after.free_runs[2].simulated[shown])


def test_bars_have_the_height_of_the_errors(found):
    figure = isojax.plot.errors(found.before, found.after, measure="nrmse")
    heights = [patch.get_height() for patch in figure.axes[0].patches]
    fits, roles = (found.before, found.after), ("fit", "holdout")
    expected = [100.0 * fit.errors[role].nrmse for fit in fits for role in roles]
    np.testing.assert_allclose(heights, expected)


def test_friction_alone_is_a_rectangle_of_its_level(found):
    figure = isojax.plot.effect(found.after, "coulomb_friction", (1e-3,), 5.0)
    level = float(found.after.model["coulomb_friction.force_level"])
    force = figure.axes[0].lines[0].get_ydata()
    assert np.max(np.abs(force)) == pytest.approx(level, rel=1e-6)
    assert np.mean(np.abs(force) > 0.99 * level) > 0.98


def test_the_band_of_the_equivalent_stiffness_is_that_of_its_closed_form(found):
    """Of a linear and a cubic spring it is k1 + 3/4 k3 X^2 (the paper, eq. 7)."""
    figure = isojax.plot.equivalent(found.guess, [("before", found.before)])
    (band,) = figure.axes[0].patches
    corners = band.get_path().vertices
    assert [one.get_text() for one in figure.axes[0].get_legend().get_texts()].count("95 % band") == 1
    for x in (corners[:, 0].min(), corners[:, 0].max()):
        wanted = isojax.uncertainty(
            found.before, lambda m, x=1e-3 * x: 1e-3 * (m["k1"] + 0.75 * m["k3"] * x**2)
        )
        ends = corners[np.isclose(corners[:, 0], x), 1]
        np.testing.assert_allclose([ends.min(), ends.max()], wanted.interval, rtol=1e-4)


def test_without_dwells_there_is_no_cycle_to_average(plain):
    with pytest.raises(ValueError, match="must be a fit of records with dwells"):
        isojax.plot.cycle_residual(plain.before)


def test_noise_alone_is_the_share_of_its_rms_in_what_was_measured(found):
    figure = isojax.plot.errors(found.before, found.after, measure="nrmse")
    (lines,) = [one for one in figure.axes[0].collections if one.get_label() == "noise alone"]
    for segment, role in zip(lines.get_segments(), ("fit", "holdout"), strict=True):
        outputs = [record.output for record in found.campaign.records if record.role == role]
        signal = np.concatenate([one - np.mean(one) for one in outputs])
        share = 100.0 * found.before.noise.sigma / np.sqrt(np.mean(signal**2))
        np.testing.assert_allclose(segment[:, 1], share, rtol=1e-6)


@pytest.mark.parametrize("what", ["input", "output"])
def test_a_record_is_drawn_sample_by_sample_with_its_quantity_and_unit(found, what):
    record = found.campaign.records[1]
    figure = isojax.plot.record(record, found.campaign, what=what, window=(0.5, 1.5))
    ax = figure.axes[0]
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), np.arange(250, 751) / 500.0)
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), getattr(record, what)[250:751])
    assert ax.get_ylabel() == {"input": "force [N]", "output": "acceleration [m/s²]"}[what]
    assert record.name in ax.get_title(loc="left")


def test_a_record_shows_which_samples_a_dwell_and_the_settling_take(found):
    record = dataclasses.replace(found.campaign.records[0], settle=200)
    ax = isojax.plot.record(record, found.campaign).axes[0]
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in ax.patches]
    shaded = [(dwell.start / 500.0, dwell.stop / 500.0) for dwell in record.dwells[1::2]]
    np.testing.assert_allclose(spans, [*shaded, (0.0, 0.4)])
    assert ax.get_legend_handles_labels()[1] == ["every second dwell", "settle"]


def test_a_window_past_the_end_of_a_record_is_refused(found):
    record = found.campaign.records[0]
    with pytest.raises(ValueError, match="must hold samples of"):
        isojax.plot.record(record, found.campaign, window=(1e3, 2e3))


def test_an_inspected_file_shows_drive_response_and_spectra(tmp_path):
    phase = 2.0 * np.pi * 5.0 * np.arange(2000) / 200.0
    rng = np.random.default_rng(1)
    columns = {
        "force": np.sin(phase),
        "acceleration": 3.0 * np.sin(phase - 1.0) + 0.01 * rng.normal(size=2000),
    }
    np.savez(tmp_path / "run.npz", **columns)
    figure = isojax.plot.inspection([isojax.records.inspect_file(tmp_path / "run.npz", 200.0)])
    drive, response, spectra = figure.axes
    assert drive.lines or drive.collections
    assert response.lines or response.collections
    strongest = max(spectra.lines, key=lambda line: line.get_ydata().size)
    assert strongest.get_xdata()[np.argmax(strongest.get_ydata())] == pytest.approx(5.0, abs=0.2)
    with pytest.raises(ValueError, match="must hold at least one inspected file"):
        isojax.plot.inspection([])


def test_every_picture_stands_under_plot_and_is_drawn_by_a_test():
    drawn = {name: plot for name, plot in vars(isojax.plot).items() if inspect.isfunction(plot)}
    del drawn["show"]  # it chooses among the others
    files = Path(__file__).parents[1].rglob("test_*.py")
    tests = "".join(file.read_text(encoding="utf-8") for file in files)
    assert {plot.__name__ for plot in drawn.values()} == {name for name in vars(plots) if name[:5] == "plot_"}
    for name, plot in drawn.items():
        assert f"plot.{name}(" in tests, f"no test draws {name}"
        signature = inspect.signature(plot)
        # A row of three axes a file is a figure of its own.
        assert name == "inspection" or signature.parameters["ax"].default is None, name
        assert signature.return_annotation is Figure, name
