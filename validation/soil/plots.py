"""Small pictures of the plots of the report."""

from pathlib import Path
from typing import Any

from validation.soil.results import Plot

SIZE_IN = (6.0, 4.0)
DPI = 110

_STYLES: dict[str, dict[str, Any]] = {
    "line": {"linestyle": "-", "linewidth": 1.4},
    "dashed": {"linestyle": "--", "linewidth": 1.1},
    "points": {"linestyle": "none", "marker": "o", "markersize": 4.5},
}


def draw(plot: Plot, path: Path) -> None:
    """Draw a plot into a PNG file, whose folder exists."""
    # Imported here: only a report needs it. Without pyplot nothing chooses a window system.
    from matplotlib.figure import Figure
    from matplotlib.ticker import StrMethodFormatter

    figure = Figure(figsize=SIZE_IN, dpi=DPI, layout="constrained")
    axes = figure.subplots()
    for number, curve in enumerate(plot.curves):
        look: dict[str, Any] = {"color": f"C{number if curve.color is None else curve.color}", "label": curve.label}
        if curve.y_high is None:
            axes.plot(curve.x, curve.y, **look, **_STYLES[curve.style])
        else:
            axes.fill_between(curve.x, curve.y, curve.y_high, alpha=0.18, linewidth=0, **look)
    if plot.logarithmic:
        axes.set(xscale="log", yscale="log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(StrMethodFormatter("{x:g}"))
        axes.tick_params(which="both", labelsize=8)
    axes.set_title(plot.title, fontsize=11)
    axes.set(xlabel=plot.x_label, ylabel=plot.y_label)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    # No version in the file: a plot that did not change does not change its file either.
    figure.savefig(path, metadata={"Software": None})
