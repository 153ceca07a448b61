"""A map of the cuts of a pile: where digging was commanded, where it began, and what each cycle brought."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX, cylinder_from_world
from lerobot_excav.envs.soil.parameters import PRESETS
from lerobot_excav.envs.tasks.clear.measures import ClearRecord
from lerobot_excav.envs.tasks.scoop.scene import cell_centres_w, draw_scene
from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.envs.tasks.scoop.targets import Target

MOST_PILES = 4
"""Piles that are drawn; more would be too small to read."""

_LEVELS_M = (0.05, 0.2, 0.4, 0.6, 0.8)
_PANEL_IN = (5.2, 5.2)


def draw_cut_map(piles: Sequence[ClearRecord], path: Path) -> None:
    """Draw the cycles of up to `MOST_PILES` episodes, seen from above, as a picture file."""
    from matplotlib.figure import Figure

    of = f" ({MOST_PILES} of {len(piles)} piles)" if len(piles) > MOST_PILES else ""
    piles = piles[:MOST_PILES]
    figure = Figure(figsize=(_PANEL_IN[0] * len(piles), _PANEL_IN[1]), dpi=110, layout="constrained")
    for axes, pile in zip(np.atleast_1d(figure.subplots(1, len(piles))), piles, strict=True):
        draw_cuts(axes, pile)
    key = "Squares: commanded regions, green where digging began inside;\ndots: where it began"
    figure.suptitle(key + of, fontsize=9)
    figure.savefig(path, metadata={"Software": None})


def draw_cuts(axes: Any, pile: ClearRecord) -> None:
    """Draw the cycles of an episode, seen from above, on matplotlib's `axes`."""
    if _pile_is_known(pile):
        _draw_pile_heights(axes, pile)
    _draw_site(axes)
    for number, cycle in enumerate(pile.cycles, start=1):
        centre_w = np.asarray(cycle.region_w)
        colour = "tab:green" if cycle.target_success else "tab:red"
        patch = Target(center_w=centre_w, yaw_rad=cylinder_from_world(np.array([*centre_w[:2], 0.0]))[1])
        axes.fill(*patch.corners_w.T, facecolor=colour, alpha=0.10, edgecolor=colour, linewidth=0.8)
        axes.text(centre_w[0], centre_w[1], str(number), ha="center", va="center", fontsize=8, color=colour)
        if cycle.onset_w is not None and cycle.source_w is not None:
            ends = np.array([cycle.onset_w[:2], cycle.source_w[:2]])
            axes.plot(*ends.T, color=colour, linewidth=0.9)
            axes.plot(*ends[0], marker="o", markersize=3.5, color=colour)
    removed = f"{100.0 * pile.pile_removed:.0f} % removed in {pile.cycle_count} cycles"
    stage = f", stage {pile.stage}" if pile.stage else ""
    dug = "" if pile.soil_words == "sand" else f", {pile.soil_words}"
    axes.set_title(f"{pile.scene_set} scene {pile.scene_id}{stage}{dug}: {removed}", fontsize=9)
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(-5.5, 3.2), ylim=(-3.2, 6.2))


def _pile_is_known(pile: ClearRecord) -> bool:
    """Tell whether the pile can be drawn as it was at first: not after digging, of older scenes, or of own soils."""
    return pile.stage == 0 and pile.simulation_version == SCOOP.simulation_version and pile.soil in PRESETS


def _draw_pile_heights(axes: Any, pile: ClearRecord) -> None:
    scene = draw_scene(pile.scene_set, pile.scene_id, soil=pile.soil, pile=pile.pile)
    axes.contourf(*cell_centres_w(), scene.heights_m.T, levels=[*_LEVELS_M, 2.0], cmap="YlOrBr", alpha=0.35)


def _draw_site(axes: Any) -> None:
    """Draw the machine and the box."""
    box = TARGET_BOX.center_w[:2] + TARGET_BOX.half_extent_m * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    axes.fill(*box.T, facecolor="none", edgecolor="tab:blue", linewidth=1.5)
    axes.text(*TARGET_BOX.center_w[:2], "box", ha="center", va="center", color="tab:blue", fontsize=9)
    axes.plot(*MACHINE_POS_W[:2], marker="s", markersize=12, color="goldenrod")
    axes.text(MACHINE_POS_W[0], MACHINE_POS_W[1] - 0.6, "machine", ha="center", fontsize=8)
