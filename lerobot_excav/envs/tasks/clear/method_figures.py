"""Pictures of several methods that cleared the same piles: how fast, where they dug, and what went wrong."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.clear.cut_map import draw_cuts
from lerobot_excav.envs.tasks.clear.cycle_record import FAILURES, NO_FAILURE
from lerobot_excav.envs.tasks.clear.measures import ClearRecord
from lerobot_excav.envs.tasks.clear.spec import CYCLES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Methods = Mapping[str, Sequence[ClearRecord]]
"""The piles of every method, by its name."""

_DPI = 90


def draw_progress(methods: Methods, path: Path) -> None:
    """Draw the part of the pile that is removed over the cycles: the mean, and the middle half of the piles.

    A pile that ends early keeps what it has reached.
    """
    figure = new_figure(8.0, 4.2)
    axes = figure.subplots()
    for name, piles in methods.items():
        removed = 100.0 * np.array([removed_by_cycle(pile) for pile in piles])
        (line,) = axes.plot(removed.mean(axis=0), marker=".", label=f"{name} (n = {len(piles)})")
        low, high = np.percentile(removed, [25.0, 75.0], axis=0)
        axes.fill_between(range(CYCLES + 1), low, high, color=line.get_color(), alpha=0.15, linewidth=0.0)
    axes.set(
        xlabel="cycles", ylabel="pile removed [%]", xlim=(0, CYCLES), xticks=range(0, CYCLES + 1, 2), ylim=(0, 100)
    )
    axes.set_title("mean of the piles; shaded: their middle half", fontsize=8)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    save(figure, path)


def removed_by_cycle(pile: ClearRecord) -> NDArray[np.float64]:
    """Return the removed part after 0 to `CYCLES` cycles (CYCLES + 1,)."""
    removed = [0.0, *(cycle.pile_removed for cycle in pile.cycles[:CYCLES])]
    return np.array(removed + [removed[-1]] * (CYCLES + 1 - len(removed)))


def draw_failures(methods: Methods, path: Path) -> None:
    """Draw what came of the cycles, a bar for every method."""
    figure = new_figure(8.0, 1.3 + 0.45 * len(methods))
    axes = figure.subplots()
    kinds = (NO_FAILURE, *FAILURES)
    shares = 100.0 * np.array([failure_shares(piles) for piles in methods.values()])
    starts = np.cumsum(shares, axis=1) - shares
    for kind, start, share in zip(kinds, starts.T, shares.T, strict=True):
        label = "as commanded" if kind == NO_FAILURE else kind
        axes.barh(list(methods), share, left=start, label=label)
    axes.invert_yaxis()
    axes.set(xlabel="cycles of a pile [%], mean of the piles", xlim=(0, 100))
    figure.legend(fontsize=8, loc="outside lower center", ncols=4)
    save(figure, path)


def failure_shares(piles: Sequence[ClearRecord]) -> list[float]:
    """Return which part of the cycles went as commanded, and which failed in each of the ways of `FAILURES`.

    Means over the piles that have cycles, each with the same weight, as in tables.
    """
    counts = [Counter(cycle.failure for cycle in pile.cycles) for pile in piles if pile.cycles]
    shares = [[count[kind] / count.total() for kind in (NO_FAILURE, *FAILURES)] for count in counts]
    return [float(share) for share in np.mean(shares, axis=0)] if shares else [0.0] * (1 + len(FAILURES))


def draw_same_pile(methods: Methods, path: Path) -> None:
    """Draw where every method dug on the first pile that all of them have cleared; nothing if there is none.

    Of a method with several trainings the first one is shown.
    """
    shared = set.intersection(*({_at_first(pile) for pile in piles} for piles in methods.values()))
    figure = new_figure(4.2 * len(methods), 4.6)
    if not shared:
        figure.text(0.5, 0.5, "No pile was cleared by all of them.", ha="center")
    else:
        panels = figure.subplots(1, len(methods), squeeze=False)[0]
        shown = min(shared)
        for axes, (name, piles) in zip(panels, methods.items(), strict=True):
            first, *others = [pile for pile in piles if _at_first(pile) == shown]
            draw_cuts(axes, first)
            which = f", first of {1 + len(others)} trainings" if others else ""
            axes.set_title(f"{name}{which}\n{axes.get_title()}", fontsize=8)
    save(figure, path)


def _at_first(pile: ClearRecord) -> tuple[Any, ...]:
    """Return what determines a pile as it was at first; what digging depends on does so at later stages only."""
    dug = (pile.density, pile.fidelity) if pile.stage else ()
    return (*pile.key, pile.simulation_version, pile.soil, pile.pile, *dug)


def save(figure: "Figure", path: Path) -> None:
    """Write a figure into a file, the same bytes for the same figure."""
    # Tight, because the constrained layout lets titles of panels of a fixed aspect reach beyond the picture.
    figure.savefig(path, metadata={"Software": None}, bbox_inches="tight", pad_inches=0.08)


def new_figure(width_in: float, height_in: float) -> "Figure":
    """Return an empty figure."""
    # Imported here: only a report needs it. Without pyplot nothing chooses a window system.
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), dpi=_DPI, layout="constrained")
