"""A warning where standard errors do not describe how chi2 rises, against least squares in closed form."""

import numpy as np
import pytest

import isojax as ij
from isojax.identification.fitting import _valley
from isojax.identification.fitting._valley import find_bent


def closed_rise(decay, name, sign):
    """The rise of chi2 one standard error away, over that of the parabola, on which it is one.

    The other coefficient follows as the parabola has it. A search that is all but over leaves a slope.
    """
    fit = decay.fit
    step = sign * fit.covariance[fit.free.index(name)] / fit.standard_errors[name]
    at = np.array([float(fit.model[one]) for one in fit.free])

    def chi2(share):
        k1, c1 = at + share * step
        return decay.chi2(c1, k1)

    slope = (chi2(1e-3) - chi2(-1e-3)) / 2e-3
    return (chi2(1.0) - chi2(0.0)) / (1.0 + slope)


@pytest.mark.parametrize("name", ["linear_stiffness.coefficient", "linear_damping.coefficient"])
def test_chi2_rises_as_the_closed_form(decay, name, monkeypatch):
    monkeypatch.setattr(_valley, "_WELL_KNOWN", 0.0)
    monkeypatch.setattr(_valley, "SAME_RISE", 1.0)  # everything counts as bent
    place = decay.fit.free.index(name)
    found = next(one for one in find_bent(decay.fit.estimate) if one.place == place)
    expected = [closed_rise(decay, name, sign) for sign in (-1.0, 1.0)]
    np.testing.assert_allclose(found.rises, expected, rtol=5e-3)


def test_a_report_warns_of_it_and_of_nothing_else(decay):
    assert decay.fit.evaluation.bent == ()
    assert "no more than a tangent" not in str(decay.fit)
    bent = _valley.Bent(1, np.array([np.nan, 16.2]))
    held = decay.fit._replace(evaluation=type("Held", (), {"bent": (bent,), "errors": decay.fit.errors})())
    (line,) = [line for line in ij.fit_report(held).splitlines() if "no more than a tangent" in line]
    assert "linear_damping.coefficient" in line
    assert "16.2 times" in line
