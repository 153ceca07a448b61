"""How far from the middle of their regions cycles begin, sideways and lengthwise, and how well the swing follows."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.tasks.clear.measures import ClearRecord
from lerobot_excav.envs.tasks.clear.method_figures import Methods, new_figure, save
from lerobot_excav.envs.tasks.clear.spec import CYCLES
from lerobot_excav.envs.tasks.scoop.feasibility import PATCH_SIZE_M

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIRST_CYCLE, LATER_CYCLES = range(1), range(1, CYCLES)
"""The first cycle of a pile begins between pile and box, the others over the box, where the one before has dumped."""

Cylinder = tuple[float, float, float]
"""Radius [m], swing angle [rad] and height [m] of a place, seen from the machine."""


def draw_entries(methods: Methods, path: Path) -> None:
    """Draw for every cycle how far from the middle of its region loading begins: the median, and the middle half.

    Cycles that loaded nothing are left out.
    """
    figure = new_figure(11.0, 4.8)
    panels = figure.subplots(1, 2, sharey=True)
    for name, piles in methods.items():
        slopes = [swing_slope(piles, cycles) for cycles in (FIRST_CYCLE, LATER_CYCLES)]
        words = " then ".join("-" if slope is None else f"{slope:.2f}" for slope in slopes)
        for axes, errors in zip(panels, entry_errors_m(piles), strict=True):
            _draw_errors(axes, errors, f"{name} (swing: {words})")
    for axes, way in zip(
        panels, ("sideways: the swing stops too early or too late", "lengthwise: the reach"), strict=True
    ):
        axes.axhline(0.5 * PATCH_SIZE_M, color="black", linestyle=":", linewidth=1.0)
        axes.set(xlabel="cycle", xlim=(1, CYCLES), xticks=range(2, CYCLES + 1, 2), ylim=(0.02, 5.0), yscale="log")
        axes.set_title(f"{way}; dotted: half a region", fontsize=8)
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("from the middle of the region [m]\n(cycles that loaded nothing are left out)", fontsize=8)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, loc="outside lower center", ncols=2)
    save(figure, path)


def entry_errors_m(piles: Sequence[ClearRecord]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far from the middle of its region loading begins, sideways and lengthwise (piles, CYCLES) [m].

    Sideways is along the swing, at the radius of the region; lengthwise along the boom. NaN where nothing was loaded.
    """
    sideways_m, lengthwise_m = (np.full((len(piles), CYCLES), np.nan) for _ in range(2))
    for pile, number, region, entry in _entries(piles):
        sideways_m[pile, number] = abs(region[0] * (entry[1] - region[1]))
        lengthwise_m[pile, number] = abs(entry[0] - region[0])
    return sideways_m, lengthwise_m


def swing_slope(piles: Sequence[ClearRecord], cycles: range) -> float | None:
    """Return the slope of the swing angle of entries on that of their regions: 1 is obedience, 0 a default angle.

    The cycles, by their numbers from 0, are taken together. None with fewer than two regions.
    """
    angles = np.array([(region[1], entry[1]) for _, number, region, entry in _entries(piles) if number in cycles])
    if len(angles) < 2 or np.ptp(angles[:, 0]) == 0.0:
        return None
    return float(np.polyfit(angles[:, 0], angles[:, 1], 1)[0])


def _entries(piles: Sequence[ClearRecord]) -> Iterator[tuple[int, int, Cylinder, Cylinder]]:
    """Yield pile, cycle, and in cylinder coordinates of the machine its region and where loading began."""
    for pile, record in enumerate(piles):
        for number, cycle in enumerate(record.cycles[:CYCLES]):
            if cycle.onset_w is not None:
                region, entry = (cylinder_from_world(np.array(w)) for w in (cycle.region_w, cycle.onset_w))
                yield pile, number, region, entry


def _draw_errors(axes: "Axes", errors_m: NDArray[np.float64], label: str) -> None:
    there = ~np.isnan(errors_m).all(axis=0)
    cycles = np.arange(1, CYCLES + 1)[there]
    if len(cycles):
        low, middle, high = np.nanpercentile(errors_m[:, there], [25.0, 50.0, 75.0], axis=0)
        (line,) = axes.plot(cycles, middle, marker=".", label=label)
        axes.fill_between(cycles, low, high, color=line.get_color(), alpha=0.1, linewidth=0.0)
