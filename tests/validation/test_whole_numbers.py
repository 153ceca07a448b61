"""Lists of whole numbers on the command line of a study."""

import argparse

import pytest

from validation.operator_delay import __main__ as operator_delay
from validation.whole_numbers import whole_numbers


@pytest.mark.parametrize(("text", "numbers"), [("", ()), ("0", (0,)), ("0,50,-3", (0, 50, -3)), ("7,", (7,))])
def test_a_list_is_read(text, numbers):
    assert whole_numbers(text) == numbers


@pytest.mark.parametrize("text", ["a", "1.5", "1 2", "1;2"])
def test_what_is_no_whole_number_is_named(text):
    with pytest.raises(argparse.ArgumentTypeError, match="give whole numbers, as in 0,50"):
        whole_numbers(text)


@pytest.mark.parametrize("option", ["--rates=", "--delays="])
def test_a_study_without_conditions_is_refused(option, capsys, tmp_path):
    with pytest.raises(SystemExit):
        operator_delay.main([option, f"--file={tmp_path / 'f'}", f"--page={tmp_path / 'p'}"])
    assert "one number at least" in capsys.readouterr().err
    assert not (tmp_path / "p").exists()
