import math

import pytest

from validation.soil.results import Check, Result, number_text


@pytest.mark.parametrize(("value", "missed_by"), [(0.5, 0.0), (1.6, 0.0), (0.4, 0.1), (1.9, 0.3), (math.nan, math.inf)])
def test_a_gate_includes_its_ends_and_tells_by_how_much_it_is_missed(value, missed_by):
    check = Check("prefactor", value, low=0.5, high=1.6)
    assert check.passed is (missed_by == 0.0)
    assert check.missed_by == pytest.approx(missed_by)
    assert Result(checks=(check,)).missed == (() if check.passed else (check,))
    assert Result(checks=(check,)).as_dict()["passed"] is check.passed


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [(0.5, 1.6, "0.5 to 1.6 m"), (0.0, 0.0, "= 0 m"), (10.0, math.inf, "≥ 10 m"), (-math.inf, 1e-9, "≤ 1e-09 m")],
)
def test_a_gate_is_put_into_words(low, high, text):
    assert Check("x", 0.0, "m", low=low, high=high).gate_text == text


NUMBERS = {0.0: "0", 1474.0: "1474", 39.001: "39", 0.8765: "0.876", 4.2e-16: "4.2e-16", -12.34: "-12.3", "sand": "sand"}


@pytest.mark.parametrize(("value", "text"), NUMBERS.items())
def test_numbers_are_shown_with_three_digits(value, text):
    assert number_text(value) == text
