import pytest

from lerobot_excav.scripts.console import delay_words


def test_nobody_who_drove_has_no_delay():
    assert delay_words([], "excavator") == []


@pytest.mark.parametrize(
    ("delays_ms", "words"),
    [([70.0] * 9 + [90.0], "loses nothing up to 100 ms, as it is here"), ([150.0] * 10, "and here it is more")],
)
def test_the_delay_is_held_against_what_is_known_of_it(delays_ms, words):
    said = delay_words(delays_ms, "excavator")
    assert f"{delays_ms[0]:.0f} ms in the median" in said[0]
    assert words in said[1]


def test_of_the_arm_nothing_is_known():
    assert delay_words([20.0, 30.0], "fr5_grasp") == [
        "stick to picture: 25 ms in the median, 29 ms or less in 9 of 10 pictures"
    ]
