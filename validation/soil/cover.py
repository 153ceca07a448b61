"""Pairwise covers: few cases in which every two values of different axes meet."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

from lerobot_excav.errors import require

_Pair = tuple[str, int, str, int]


def pairwise_cover(axes: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """Return cases, one value per axis, so that any two values of two axes occur together in at least one of them.

    A fault that two settings make together shows, at the cost of about the product of the two longest axes in place of
    the product of all. The same axes give the same cases; the first one has the first value of every axis.

    Args:
        axes: Values by the name of their axis, at least two axes with at least one value each.

    Raises:
        ConfigurationError: There are fewer axes, or an axis has no value.
    """
    require(len(axes) >= 2, f"axes={list(axes)}; allowed: at least two, else there are no pairs to cover.")
    for name, values in axes.items():
        require(len(values) >= 1, f"axis {name!r} has no value; leave it out or give it one.")
    open_pairs = {
        (a, i, b, j): None for a, b in combinations(axes, 2) for i in range(len(axes[a])) for j in range(len(axes[b]))
    }
    cases = []
    while open_pairs:
        chosen = _next_case(axes, open_pairs)
        for a, b in combinations(axes, 2):
            open_pairs.pop((a, chosen[a], b, chosen[b]), None)
        cases.append({name: axes[name][k] for name, k in chosen.items()})
    return cases


def _next_case(axes: Mapping[str, Sequence[Any]], open_pairs: Mapping[_Pair, None]) -> dict[str, int]:
    """Return the index of a value per axis: the first pair that is still open, and what closes most others with it."""
    a, i, b, j = next(iter(open_pairs))
    chosen = {a: i, b: j}
    for name in axes:
        if name not in chosen:
            gains = [_closed(axes, open_pairs, chosen, name, k) for k in range(len(axes[name]))]
            chosen[name] = gains.index(max(gains))
    return {name: chosen[name] for name in axes}


def _closed(
    axes: Mapping[str, Sequence[Any]],
    open_pairs: Mapping[_Pair, None],
    chosen: Mapping[str, int],
    name: str,
    index: int,
) -> int:
    """Return how many open pairs a value would close with the values chosen so far."""
    order = list(axes)
    pairs = (
        (other, k, name, index) if order.index(other) < order.index(name) else (name, index, other, k)
        for other, k in chosen.items()
    )
    return sum(pair in open_pairs for pair in pairs)
