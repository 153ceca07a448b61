import json
import math

import pytest

from validation.soil.results import Check, Result, Table, number_text


@pytest.mark.parametrize(
    ("value", "passed", "missed_by"),
    [(0.5, True, 0.0), (1.6, True, 0.0), (0.4, False, 0.1), (1.9, False, 0.3), (math.nan, False, math.inf)],
)
def test_a_gate_includes_its_ends_and_tells_by_how_much_it_is_missed(value, passed, missed_by):
    check = Check("prefactor", value, low=0.5, high=1.6)
    assert check.passed is passed
    assert check.missed_by == pytest.approx(missed_by)


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [(0.5, 1.6, "0.5 to 1.6"), (0.0, 0.0, "= 0"), (10.0, math.inf, "≥ 10"), (-math.inf, 1e-9, "≤ 1e-09")],
)
def test_a_gate_is_put_into_words(low, high, text):
    assert Check("x", 0.0, low=low, high=high).gate_text == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1474.0, "1474"), (39.001, "39"), (0.8765, "0.876"), (4.2e-16, "4.2e-16"), (-12.34, "-12.3")],
)
def test_numbers_are_shown_with_three_digits(value, text):
    assert number_text(value) == text


def test_a_result_names_what_missed_and_is_plain_data():
    good, bad = Check("good", 1.0, low=0.0), Check("bad", math.nan, high=1.0)
    result = Result(checks=(good, bad), tables=(Table(("a",), ((1.0,),)),))
    assert not result.passed
    assert result.missed == (bad,)
    written = json.loads(json.dumps(result.as_dict(), allow_nan=False))
    assert [check["passed"] for check in written["checks"]] == [True, False]
    assert written["checks"][1]["value"] is None
