import pytest

from isojax._quantities import (
    typeset_goodness,
    typeset_number,
    typeset_p_value,
    typeset_share,
    typeset_unit,
    typeset_with_error,
)

NAN = float("nan")


@pytest.mark.parametrize(
    ("value", "error", "unit", "words"),
    [
        (3.98326, 0.0511, "N", "3.983 ± 0.051 N"),
        (1.12047e6, 429.0, "N/m", "(1.12047 ± 0.00043)×10⁶ N/m"),
        (-7.13878e8, 1.92e6, "N/m^2", "(-7.139 ± 0.019)×10⁸ N/m²"),
        (2.45e-5, 6.6e-6, "s", "(2.45 ± 0.66)×10⁻⁵ s"),
        (0.02, 1.7, "N", "0.0 ± 1.7 N"),
        (9.996, 0.1, "N", "10.00 ± 0.10 N"),
        (10106.0, 18.0, "N s/m", "10106 ± 18 N s/m"),
        (800.0, NAN, "kg", "800.0 kg"),
        (NAN, 1.0, "kg", "– kg"),
        (0.00153, 0.00028, "1", "0.00153 ± 0.00028"),
    ],
)
def test_value_and_error_have_the_digits_of_the_error(value, error, unit, words):
    assert typeset_with_error(value, error, unit) == words


def test_numbers_shares_and_chances_in_words():
    assert typeset_number(0.0) == "0"
    assert typeset_number(-7.139e8, 3) == "-7.14×10⁸"
    assert typeset_number(99999.9) == "1.000×10⁵"
    assert typeset_share(0.0403) == "4.03 %"
    assert typeset_share(0.997) == "99.7 %"
    assert typeset_share(NAN) == "–"
    assert typeset_goodness(2.8551) == "2.855"
    assert typeset_goodness(12345.0) == "12345"
    assert typeset_p_value(1e-12) == "< 10⁻⁶"
    assert typeset_p_value(0.03) == "0.03"
    assert typeset_p_value(6.4e-6) == "6.4×10⁻⁶"


def test_units_are_raised_and_resolved():
    assert typeset_unit("N s^2/m^2") == "N s²/m²"
    assert typeset_unit("m^-3") == "m⁻³"
    assert typeset_unit("1") == ""
