import numpy as np
import pytest
from matplotlib.figure import Figure

from isojax import reporting
from isojax.identification import residual


def pairs(loop):
    return [("before", loop.before), ("after", loop.after)]


PLOTS = {
    "time_history": lambda loop, ax: reporting.plot_time_history(loop.before, loop.after, ax=ax),
    "residual": lambda loop, ax: reporting.plot_residual(loop.before, loop.after, ax=ax),
    "cycle_residual": lambda loop, ax: reporting.plot_cycle_residual(loop.before, loop.after, ax=ax),
    "where": lambda loop, ax: reporting.plot_where(loop.before, loop.after, ax=ax),
    "correlation": lambda loop, ax: reporting.plot_correlation(
        residual(loop.before), residual(loop.after), ax=ax
    ),
    "receptance": lambda loop, ax: reporting.plot_receptance(loop.guess, ax=ax),
    "backbone": lambda loop, ax: reporting.plot_receptance(
        loop.guess, what="displacement", fits=pairs(loop), ax=ax
    ),
    "stiffness": lambda loop, ax: reporting.plot_equivalent(loop.guess, pairs(loop), ax=ax),
    "damping": lambda loop, ax: reporting.plot_equivalent(loop.guess, pairs(loop), what="damping", ax=ax),
    "restoring_force": lambda loop, ax: reporting.plot_restoring_force(loop.before, loop.after, ax=ax),
    "effect": lambda loop, ax: reporting.plot_effect(
        loop.after, "coulomb_friction", (1e-4, 1e-3), 5.0, ax=ax
    ),
    "ranking": lambda loop, ax: reporting.plot_ranking(
        loop.findings[0].ranking, effect="coulomb_friction", indistinguishable=("dahl_friction",), ax=ax
    ),
    "errors": lambda loop, ax: reporting.plot_errors(loop.before, loop.after, ax=ax),
    "stiffness_scatter": lambda loop, ax: reporting.plot_stiffness_scatter(loop.before, loop.after, ax=ax),
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


@pytest.mark.parametrize("name", ["time_history", "restoring_force", "errors"])
def test_a_plot_without_axes_makes_its_own_figure(found, name):
    figure = PLOTS[name](found, None)
    assert isinstance(figure, Figure)
    assert len(figure.axes) == 1


def test_curves_show_what_was_measured_and_simulated(found):
    figure = reporting.plot_time_history(found.before, found.after, record=2, window=(1.0, 2.0))
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    record = found.campaign.records[2]
    shown = (record.time >= 1.0) & (record.time <= 2.0)
    np.testing.assert_array_equal(lines["measured"], record.output[shown])
    np.testing.assert_array_equal(lines["after"], found.after.free_runs[2].simulated[shown])


def test_bars_have_the_height_of_the_errors(found):
    figure = reporting.plot_errors(found.before, found.after, measure="nrmse")
    heights = [patch.get_height() for patch in figure.axes[0].patches]
    fits, roles = (found.before, found.after), ("fit", "holdout")
    expected = [100.0 * fit.errors[role].nrmse for fit in fits for role in roles]
    np.testing.assert_allclose(heights, expected)


def test_friction_alone_is_a_rectangle_of_its_level(found):
    figure = reporting.plot_effect(found.after, "coulomb_friction", (1e-3,), 5.0)
    level = float(found.after.model["coulomb_friction.force_level"])
    force = figure.axes[0].lines[0].get_ydata()
    assert np.max(np.abs(force)) == pytest.approx(level, rel=1e-6)
    assert np.mean(np.abs(force) > 0.99 * level) > 0.98


def test_without_dwells_there_is_no_cycle_to_average(plain):
    assert reporting.plot_cycle_residual(plain.before) is None
