"""Pictures of an audit."""

from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lerobot_excav.evaluation.audit.audit import Audit
from lerobot_excav.evaluation.audit.branch import Branch
from lerobot_excav.evaluation.audit.obedience import deviations_m
from lerobot_excav.evaluation.audit.settings import MOMENTS, POLICY

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_SCENES = 4
"""Scenes whose tool paths are drawn; more would be too small to read."""

_DPI = 90


def draw_separation(audit: Audit, path: Path) -> None:
    """Draw how far masks drive actions and tool apart, a column for every moment."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.4 * len(MOMENTS), 5.0), dpi=_DPI, layout="constrained")
    grid = figure.subplots(2, len(MOMENTS), sharey="row", squeeze=False)
    for moment, (above, below) in zip(MOMENTS, grid.T, strict=True):
        for label, by_moment in audit.separation.items():
            if moment in by_moment and by_moment[moment].scenes:
                curves = by_moment[moment]
                times_s = np.arange(len(curves.scenes)) / audit.settings.env.fps
                above.plot(times_s, curves.tool_m, label=label)
                below.plot(times_s, curves.actions, label=label)
        above.set_title(f"mask given: {moment}", fontsize=10)
        below.set_xlabel("time since then [s]")
        for axes in (above, below):
            axes.grid(alpha=0.3)
    grid[0, 0].set_ylabel("tool, between two masks [m]")
    grid[1, 0].set_ylabel("actions, between two masks")
    grid[0, 0].legend(fontsize=7)
    figure.savefig(path, metadata={"Software": None})


def draw_places(audit: Audit, path: Path) -> None:
    """Draw acted against commanded places, less the means of their scenes, a panel for everybody who acted."""
    from matplotlib.figure import Figure

    labels = list(audit.obedience)
    figure = Figure(figsize=(3.2 * len(labels), 3.5), dpi=_DPI, layout="constrained")
    for label, axes in zip(labels, figure.subplots(1, len(labels), squeeze=False)[0], strict=True):
        _draw_places(axes, label, audit)
    figure.savefig(path, metadata={"Software": None})


def _draw_places(axes: "Axes", label: str, audit: Audit) -> None:
    by_scene = defaultdict(list)
    for branch in audit.branches[label]:
        if branch.moment == MOMENTS[0] and branch.acted_w is not None:
            by_scene[branch.scene_id].append(branch)
    pairs = [deviations_m(scene) for scene in by_scene.values() if len(scene) > 1]
    slope = audit.obedience[label].slope
    if pairs and slope is not None:
        told, did = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
        reach = 1.1 * float(np.abs(told).max())
        for axis, name in enumerate("xy"):
            axes.plot(told[:, axis], did[:, axis], ".", markersize=4, alpha=0.6, label=name)
        ends = np.array([-reach, reach])
        axes.plot(ends, ends, color="grey", linewidth=0.8, linestyle="--", label="obedience")
        axes.plot(ends, slope.estimate * ends, color="black", linewidth=1.0, label=f"slope {slope.estimate:.2f}")
        axes.set(xlim=ends, ylim=ends, aspect="equal")
        axes.legend(fontsize=7, loc="upper left")
    axes.set_title(f"{label}: {audit.verdicts[label].verdict}", fontsize=9)
    axes.set(xlabel="commanded [m]", ylabel="acted [m]")
    axes.grid(alpha=0.3)


def draw_paths(audit: Audit, path: Path) -> None:
    """Draw the tool's paths from above under every mask, for the first scenes of the policy."""
    from matplotlib.figure import Figure

    scene_ids = list(audit.settings.scene_ids)[:MOST_SCENES]
    figure = Figure(figsize=(3.4 * len(scene_ids), 3.7), dpi=_DPI, layout="constrained")
    for scene_id, axes in zip(scene_ids, figure.subplots(1, len(scene_ids), squeeze=False)[0], strict=True):
        for branch in audit.branches[POLICY]:
            if branch.scene_id == scene_id and branch.moment == MOMENTS[0]:
                _draw_path(axes, branch)
        axes.set_title(f"scene {scene_id}", fontsize=9)
        axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
        axes.grid(alpha=0.3)
    figure.suptitle("Crosses: commanded; dots: where acting began; lines: the tool, from above", fontsize=9)
    figure.savefig(path, metadata={"Software": None})


def _draw_path(axes: "Axes", branch: Branch) -> None:
    colour = f"C{branch.target_id}"
    x_w, y_w, _ = np.array(branch.tool_path_w).T
    axes.plot(x_w, y_w, color=colour, linewidth=0.7, alpha=0.8)
    axes.plot(*branch.commanded_w, "x", color=colour, markersize=9, markeredgewidth=2)
    if branch.began_w is not None:
        axes.plot(*branch.began_w, "o", color=colour, markersize=5)
