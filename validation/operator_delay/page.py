"""The page of the study: a table, two curves, and what was done."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lerobot_excav.evaluation.statistics import Interval, bootstrap_mean, wilson_interval
from lerobot_excav.whole_file import write_whole

IMAGE = Path("images", "rate_and_delay.png")

_HEAD = """# Frame rate and delay

Written by `python -m validation.operator_delay --scoops={n}`; do not edit it.

The scripted operator looks and commands at some rate, and each command reaches the machine late by some time; it knows
nothing of the delay. A command holds until the next one, so at 10 a second the machine already acts on a look that is
50 ms old on average. {n} scoops of `val` in each condition, the same ones in all, operator's seed 0, version {version}
of the simulation, fidelity `standard`. Success is that of `Scoop-v0`; 95 % intervals are Wilson's for rates, and a
bootstrap over scoops for means.

![Success and retained mass over the delay](images/rate_and_delay.png)

| commands a second | delay [ms] | success [%] | region hit [%] | retained [kg] | hard contacts | time of a cycle [s] |
|---|---|---|---|---|---|---|
"""


def write_page(scoops: Sequence[dict[str, Any]], path: Path) -> None:
    """Write the page and its picture, which lies in `images` beside it."""
    rates = sorted({scoop["rate_hz"] for scoop in scoops})
    delays = sorted({scoop["delay_ms"] for scoop in scoops})
    cells = {
        (rate, delay): [s for s in scoops if (s["rate_hz"], s["delay_ms"]) == (rate, delay)]
        for rate in rates
        for delay in delays
    }
    n = min(len(cell) for cell in cells.values())
    head = _HEAD.format(n=n, version=scoops[0]["simulation_version"])
    rows = [_row(rate, delay, cell) for (rate, delay), cell in cells.items()]
    image = path.parent / IMAGE
    image.parent.mkdir(parents=True, exist_ok=True)
    _draw(cells, rates, delays, image)
    write_whole(path, head + "\n".join(rows) + "\n")


def _success(cell: Sequence[dict[str, Any]], key: str = "is_success") -> Interval:
    return wilson_interval(sum(bool(scoop[key]) for scoop in cell), len(cell))


def _retained_kg(cell: Sequence[dict[str, Any]]) -> Interval:
    values = np.array([scoop["retained_mass_kg"] for scoop in cell])
    return bootstrap_mean(values, np.random.default_rng(0))


def _row(rate_hz: int, delay_ms: int, cell: Sequence[dict[str, Any]]) -> str:
    success, hit, retained = _success(cell), _success(cell, "target_success"), _retained_kg(cell)
    rate_text = [f"{100 * i.estimate:.0f} [{100 * i.low:.0f}, {100 * i.high:.0f}]" for i in (success, hit)]
    contacts = sum(scoop["hard_target_contacts"] for scoop in cell)
    duration_s = float(np.mean([scoop["duration_s"] for scoop in cell]))
    kg = f"{retained.estimate:.0f} [{retained.low:.0f}, {retained.high:.0f}]"
    return f"| {rate_hz} | {delay_ms} | {rate_text[0]} | {rate_text[1]} | {kg} | {contacts} | {duration_s:.1f} |"


def _draw(
    cells: dict[tuple[int, int], list[dict[str, Any]]], rates: Sequence[int], delays: Sequence[int], path: Path
) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2)
    for number, rate in enumerate(rates):
        for axes, measure, scale in ((left, _success, 100.0), (right, _retained_kg, 1.0)):
            found = [measure(cells[rate, delay]) for delay in delays]
            look: dict[str, Any] = {"color": f"C{number}", "label": f"{rate} commands a second"}
            axes.plot(delays, [scale * i.estimate for i in found], marker="o", markersize=4, **look)
            low, high = ([scale * getattr(i, end) for i in found] for end in ("low", "high"))
            axes.fill_between(delays, low, high, alpha=0.12, linewidth=0, color=look["color"])
    left.set(xlabel="delay [ms]", ylabel="success [%]", ylim=(0, 102))
    right.set(xlabel="delay [ms]", ylabel="retained mass [kg]", ylim=(0, None))
    for axes in (left, right):
        axes.grid(alpha=0.3)
    left.legend(fontsize=8)
    figure.savefig(path, metadata={"Software": None})
