"""Lists of whole numbers on a command line."""

import argparse


def whole_numbers(text: str) -> tuple[int, ...]:
    """Return the numbers of a list such as `0,50`; none of an empty one.

    Raises:
        ArgumentTypeError: A part is not a whole number.
    """
    try:
        return tuple(int(part) for part in text.split(",") if part)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}; give whole numbers, as in 0,50") from None
