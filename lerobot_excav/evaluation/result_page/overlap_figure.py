"""A picture of how good a mask has to be: success against its overlap with the target."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from lerobot_excav.envs.tasks.measures import EpisodeRecord
from lerobot_excav.evaluation.statistics import Interval, wilson_interval

ABOUT = "success against the overlap of mask and target"
ENTRY = f"{__name__}:draw_success_by_overlap"

_SIZE_IN = (8.0, 3.6)
_DPI = 90
_EDGES = np.linspace(0.0, 1.0, 11)


def has_imprecise_masks(episodes: Iterable[EpisodeRecord]) -> bool:
    """Whether some episodes have masks with an error, and their files say how well those fit."""
    return any(error_words(episode) and overlap(episode) is not None for episode in episodes)


def overlap(episode: EpisodeRecord) -> float | None:
    """Return how well the mask fitted its target; 0 if nothing was left of it, None if the file does not say it."""
    return 0.0 if episode.mask_iou is None and episode.mask_missing else episode.mask_iou


def error_words(episode: EpisodeRecord) -> str:
    """Return the kinds of errors of an episode's mask, whatever their size; empty without one.

    Also empty where more than the error counts: the mask of something else, or a change of the command.
    """
    if episode.mask_condition != "correct" or episode.changes:
        return ""
    words = [] if episode.mask_noise == "none" else [episode.mask_noise]
    words += ["dropout"] if episode.mask_dropout else []
    words += ["snapped"] if words and episode.mask_snap else []
    return ", ".join(words)


def success_by_overlap(episodes: Sequence[EpisodeRecord]) -> list[tuple[float, int, Interval]]:
    """Return, for every tenth of the overlap in which there are episodes, their mean overlap, number and success."""
    known = [(overlap(episode), episode.is_success) for episode in episodes if overlap(episode) is not None]
    overlaps, successes = np.array(known, dtype=float).reshape(-1, 2).T
    bins = np.clip(np.digitize(overlaps, _EDGES) - 1, 0, len(_EDGES) - 2)
    chosen = [bins == number for number in np.unique(bins)]
    return [
        (float(overlaps[one].mean()), int(one.sum()), wilson_interval(int(successes[one].sum()), int(one.sum())))
        for one in chosen
    ]


def draw_success_by_overlap(rows: Mapping[str, Sequence[EpisodeRecord]], path: Path) -> None:
    """Draw success with 95 % Wilson intervals against the overlap, a line for each kind of error, into a PNG file.

    Args:
        rows: Episodes by the name of their row; those of one kind of error are taken together, others left out.
        path: The file.
    """
    from matplotlib.figure import Figure

    kinds: dict[str, list[EpisodeRecord]] = {}
    for episode in (episode for episodes in rows.values() for episode in episodes):
        if words := error_words(episode):
            kinds.setdefault(words, []).append(episode)
    figure = Figure(figsize=_SIZE_IN, dpi=_DPI, layout="constrained")
    axes = figure.subplots()
    for kind, episodes in kinds.items():
        points = success_by_overlap(episodes)
        if not points:
            continue
        rates = 100.0 * np.array([(rate.low, rate.estimate, rate.high) for _, _, rate in points]).T
        errors = np.abs(rates[[0, 2]] - rates[1])
        label = f"{kind} (n = {sum(number for _, number, _ in points)})"
        axes.errorbar([x for x, _, _ in points], rates[1], yerr=errors, marker="o", capsize=3, label=label)
    axes.set(
        xlabel="overlap of mask and target (intersection over union, mean over an episode)",
        ylabel="success [%]",
        xlim=(-0.02, 1.02),
        ylim=(-3, 103),
    )
    axes.set_title("episodes by tenths of their overlap; bars: 95 % intervals", fontsize=8)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
