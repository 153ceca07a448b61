"""Plots of a result page."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lerobot_excav.evaluation.result_page.curves import CurvePoint, SuccessCurve

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIZE_IN = (8.0, 3.2)
_DPI = 90


def plot_curves(curves: Sequence[SuccessCurve], path: Path) -> None:
    """Draw success with 95 % intervals against training steps and, where logs tell, minutes, into a PNG file."""
    # Imported here: only a report needs it. Without pyplot nothing chooses a window system.
    from matplotlib.figure import Figure

    timed = any(point.minutes is not None for curve in curves for point in curve.points)
    figure = Figure(figsize=_SIZE_IN, dpi=_DPI, layout="constrained")
    axes = figure.subplots(1, 2 if timed else 1, sharey=True, squeeze=False)[0]
    for curve in curves:
        _draw(axes[0], curve.label, [(point.step, point) for point in curve.points])
        if timed:
            known = [(point.minutes, point) for point in curve.points if point.minutes is not None]
            _draw(axes[1], curve.label, known)
    axes[0].set(xlabel="training steps", ylabel="success [%]", ylim=(-3, 103))
    if timed:
        axes[1].set(xlabel="training time [min]")
    for axis in axes:
        axis.grid(alpha=0.3)
    axes[-1].legend(loc="lower right", fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)


def _draw(axis: "Axes", label: str, points: Sequence[tuple[float, CurvePoint]]) -> None:
    rates = [(point.success.low, point.success.estimate, point.success.high) for _, point in points]
    low, estimate, high = 100.0 * np.array(rates).reshape(-1, 3).T
    places, errors = [place for place, _ in points], [estimate - low, high - estimate]
    axis.errorbar(places, estimate, yerr=errors, marker="o", capsize=3, label=label)
