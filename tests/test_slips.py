"""Natural slips do what was meant, or the message says what to pass."""

import dataclasses

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

import isojax as ij
from isojax._given_numbers import as_numbers
from isojax.demo import campaign_folder
from reporting.conftest import RANKING, cut


@pytest.fixture(scope="module")
def made():
    whole = ij.read_campaign(campaign_folder())
    chosen = [record for record in whole.records if "backward" not in record.name]
    campaign = dataclasses.replace(whole, records=tuple(cut(record, 3) for record in chosen))
    guess = ij.classical_guess(campaign)
    before = ij.fit(guess, campaign)
    after = ij.fit(before.model.with_elements(ij.CoulombFriction(25.0, 1e-4)), campaign)
    identification = ij.identification
    finding = identification.Finding("coulomb_friction", (), 1e-9, 0.97, float("nan"), RANKING, "")
    verdict = identification.Verdict("found", finding, RANKING, (), 0.03, (), {}, after, "It fits.")
    extension = ij.extend(before, verdict)
    loop = identification.Loop(
        campaign, guess, before, (extension,), after, "found", verdict._replace(finding=None), {}, 12.5
    )
    return campaign, guess, before, extension, verdict, loop


@pytest.mark.slow
def test_a_guess_serves_as_the_start_of_a_fit(made):
    campaign, guess, before, *_ = made
    assert before.start is guess.model
    np.testing.assert_array_equal(ij.fit(guess.model, campaign).covariance, before.covariance)


@pytest.mark.slow
def test_a_campaign_by_itself_is_fitted_from_its_classical_guess(made):
    campaign, _, before, *_ = made
    np.testing.assert_allclose(ij.fit(campaign).covariance, before.covariance)


@pytest.mark.slow
def test_the_last_fit_of_an_extension_or_loop_is_meant(made):
    _, _, _, extension, _, loop = made
    closed = ij.reporting.ClosedLoop(loop)
    for several in (extension, loop, closed):
        assert ij.identification.as_fit(several) is extension.fit
        assert several.model is extension.fit.model
        assert ij.models.as_isolator(several) is extension.fit.model
    assert ij.find_separating_experiment(loop).effect == "coulomb_friction"
    with pytest.raises(ValueError, match=r"must be an extension, .* type Loop"):
        ij.find_separating_experiment(dataclasses.replace(loop, extensions=()))
    np.testing.assert_array_equal(ij.residual(loop).whiteness, ij.residual(extension.fit).whiteness)


@pytest.mark.slow
def test_pictures_and_tables_take_what_holds_two_fits(made):
    _, _, before, extension, verdict, loop = made

    def labels(figure):
        return [text.get_text() for text in figure.axes[0].get_legend().get_texts()]

    whole = labels(ij.plot.time_history(before, extension.fit))
    assert whole == ["measured", "before", "after"]
    for given in ((before, extension), (extension,), (loop,), (ij.reporting.ClosedLoop(loop),)):
        assert labels(ij.plot.time_history(*given)) == whole
        assert str(ij.error_table(*given)) == str(ij.error_table(before, extension.fit))
    picture = ij.plot.ranking(verdict)
    wanted = ij.plot.ranking(RANKING, effect="coulomb_friction")
    assert labels(picture) == labels(wanted)
    assert str(ij.ranking_table(verdict)) == str(ij.ranking_table(RANKING))


@pytest.mark.slow
def test_every_result_draws_its_own_picture(made):
    campaign, guess, before, extension, verdict, loop = made
    mpl.use("agg")
    for one in (campaign, guess, before, extension, verdict, loop, ij.reporting.ClosedLoop(loop)):
        assert isinstance(one.plot(), Figure)
    assert isinstance(ij.plot.show(ij.residual(before)), Figure)
    with pytest.raises(ValueError, match=r"`result` must be one of BackboneCurve, .* but is a Isolator"):
        ij.plot.show(before.model)


@pytest.mark.slow
def test_tables_print_as_text(made):
    _, _, before, extension, verdict, loop = made
    assert "linear_stiffness.coefficient" in str(ij.parameter_table(before, extension))
    assert "χ²/dof" in repr(ij.error_table(before))
    assert "It fits." in str(ij.reporting.verdict_summary(verdict))
    assert "NRMSE" in str(ij.reporting.loop_summary(loop))
    assert "coulomb_friction" in str(ij.reporting.catalogue_table())


@pytest.mark.slow
def test_coefficients_are_found_by_symbol_and_by_name(made):
    _, _, before, *_ = made
    one = before.parameters["k1"]
    assert one is not None
    assert one == before.parameters["linear_stiffness.coefficient"]
    assert one.value == float(before.model["linear_stiffness.coefficient"])
    assert one.standard_error == before.standard_errors["linear_stiffness.coefficient"]
    assert one.unit == "N/m"
    with pytest.raises(KeyError, match=r"'k9' is none of .*linear_stiffness.coefficient \(k1\)"):
        before.parameters["k9"]
    table = before.to_dataframe()
    assert list(table.index) == list(before.parameters)
    assert table.loc["linear_stiffness.coefficient", "value"] == one.value


def test_a_symbol_that_two_coefficients_share_is_refused():
    coefficients = ij.identification.Coefficients(
        tuple(
            ij.identification.Coefficient(name, "Fc", 1.0, 0.1, "N", 1.0, True) for name in ("one.f", "two.f")
        )
    )
    with pytest.raises(KeyError, match=r"'Fc' is the symbol of one.f and two.f"):
        coefficients["Fc"]


@pytest.mark.slow
def test_a_fit_comes_back_from_its_file(made, tmp_path):
    before = made[2]
    before.save(tmp_path / "fit.json")
    loaded = ij.load_fit(tmp_path / "fit.json")
    assert loaded.to_dict() == before.to_dict()
    np.testing.assert_array_equal(loaded.covariance, before.covariance)
    np.testing.assert_array_equal(loaded.mixture.covariances, before.mixture.covariances)
    assert [float(one.value) for one in loaded.model.parameters] == [
        float(one.value) for one in before.model.parameters
    ]
    assert loaded.parameters.entries[1:] == before.parameters.entries[1:]
    assert loaded.free == before.free
    assert loaded.stats == before.stats
    assert loaded.errors == before.errors
    assert ij.is_successful(loaded.result)
    assert loaded.noise == before.noise
    loaded.save(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "fit.json").read_bytes()


@pytest.mark.parametrize("text", ["", "[]", '{"format": "isojax-fit", "version": 1}', '{"format": "other"}'])
def test_what_is_no_saved_fit_is_refused(text, tmp_path):
    (tmp_path / "fit.json").write_text(text)
    with pytest.raises(ValueError, match=r"fit\.json: (is no|must hold)"):
        ij.load_fit(tmp_path / "fit.json")
    with pytest.raises(ValueError, match="cannot be read"):
        ij.load_fit(tmp_path / "none.json")


def test_a_pair_of_numbers_is_no_grid():
    model = ij.paper.y_direction()
    with pytest.raises(ValueError, match=r"`amplitudes` must list .* np.linspace\(1, 120, 100\)"):
        ij.stability_map(model, (1, 120), np.linspace(4.0, 8.0, 3))
    with pytest.raises(ValueError, match="`frequencies` must list"):
        ij.transmissibility(model, 100.0, (4.0, 8.0))


def test_each_cell_of_a_map_says_how_its_search_ended():
    smap = ij.stability_map(
        ij.paper.y_direction(), np.array([100.0, 175.0]), np.array([4.2, 5.0]), coexisting=True
    )
    assert smap.result.shape == (3, 2, 2)
    assert repr(smap.result[0, 0, 0]) == "successful"
    assert repr(smap.result[2, 0, 1]).startswith("The cell holds no further orbit")
    assert ij.is_successful(smap.result[0, 0, 0])
    found = np.asarray(smap.result == ij.RESULTS.successful)
    np.testing.assert_array_equal(found.sum(axis=0), smap.count)
    assert repr(smap.result).startswith(f"3 × 2 × 2 outcomes: {found.sum()} successful; ")


def test_messages_say_what_to_pass(unchecked):
    model = ij.paper.y_direction()
    with pytest.raises(ValueError, match=r"`model` must be an isolator, such as .* type Harmonic"):
        ij.models.as_isolator(ij.Harmonic(1.0, 5.0))
    for wrong in (float("nan"), float("inf")):
        with pytest.raises(ValueError, match=rf"`model` must hold finite numbers, but cubic.* is {wrong}"):
            ij.find_periodic_orbit(model.replace(k3=wrong), ij.Harmonic(60.0, 5.0))
    with pytest.raises(ValueError, match=r"`fit` must be a fit, .* type Isolator"):
        ij.identification.as_fit(model)
    with pytest.raises(ValueError, match=r"must be a tuple \(x, v\), not of type float"):
        model.restoring_force(1e-3, 0.0)
    with pytest.raises(ValueError, match=r"real numbers, but gave complex ones. Give their moduli"):
        as_numbers("quantity", 1j)
    with pytest.raises(ValueError, match=r"nowhere"):
        ij.close_loop("nowhere")
    with pytest.raises(ValueError, match=r"nowhere"):
        ij.fit("nowhere/campaign.toml")
