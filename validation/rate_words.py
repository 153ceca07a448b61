"""A rate as studies print it."""

from lerobot_excav.evaluation.statistics import wilson_interval


def rate_words(successes: int, n: int) -> str:
    """Return a rate with its number of trials and its 95 % Wilson interval, such as `3 of 4, 75% [30%, 95%]`."""
    interval = wilson_interval(successes, n)
    return f"{successes} of {n}, {successes / n:.0%} [{interval.low:.0%}, {interval.high:.0%}]"
