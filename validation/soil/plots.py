"""Plots of the report as small pictures."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from validation.soil.results import Plot, Series

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE_IN = (6.0, 4.0)
DPI = 110

_STYLES: dict[str, dict[str, Any]] = {
    "line": {"linestyle": "-", "linewidth": 1.4},
    "dashed": {"linestyle": "--", "linewidth": 1.1},
    "points": {"linestyle": "none", "marker": "o", "markersize": 4.5},
}


def draw(plot: Plot, path: Path) -> None:
    """Draw a plot into a PNG file.

    Args:
        plot: What to draw.
        path: File to write; its folder exists.
    """
    # Imported here: only a report needs it. Without pyplot nothing chooses a window system.
    from matplotlib.figure import Figure
    from matplotlib.ticker import StrMethodFormatter

    figure = Figure(figsize=SIZE_IN, dpi=DPI, layout="constrained")
    axes = figure.subplots()
    for number, curve in enumerate(plot.curves):
        _draw_curve(axes, curve, f"C{number if curve.color is None else curve.color}")
    if plot.logarithmic:
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(StrMethodFormatter("{x:g}"))
        axes.tick_params(which="both", labelsize=8)
    axes.set_title(plot.title, fontsize=11)
    axes.set_xlabel(plot.x_label)
    axes.set_ylabel(plot.y_label)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    # No version in the file: a plot that did not change does not change its file either.
    figure.savefig(path, metadata={"Software": None})


def _draw_curve(axes: "Axes", curve: Series, color: str) -> None:
    if curve.y_high is not None:
        axes.fill_between(curve.x, curve.y, curve.y_high, color=color, alpha=0.18, linewidth=0, label=curve.label)
        return
    axes.plot(curve.x, curve.y, color=color, label=curve.label, **_STYLES[curve.style])
