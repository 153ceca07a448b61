"""Success against training: evaluations of several checkpoints of one training."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.provenance import read_provenance
from lerobot_excav.evaluation.result_page.contents import CurveSource
from lerobot_excav.evaluation.statistics import Interval, wilson_interval


@dataclass(frozen=True, kw_only=True)
class CurvePoint:
    """Success of one checkpoint.

    Attributes:
        step: Its training step.
        minutes: Training time up to it [min]; None if no log tells.
        scene_set: Scenes that it played.
        n: Episodes.
        success: Rate with Wilson interval.
        metrics: The metrics file.
    """

    step: int
    minutes: float | None
    scene_set: str
    n: int
    success: Interval
    metrics: Path

    def as_dict(self) -> dict[str, Any]:
        """Return the point as plain data."""
        known = {"step": self.step, "minutes": self.minutes, "scene_set": self.scene_set, "n": self.n}
        return {**known, "success": asdict(self.success)}


@dataclass(frozen=True, kw_only=True)
class Curve:
    """Success of the checkpoints of one training, by their step.

    Attributes:
        label: Name in the plot.
        name: Name of the training.
        points: The checkpoints.
    """

    label: str
    name: str
    points: tuple[CurvePoint, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the curve as plain data."""
        return {"label": self.label, "name": self.name, "points": [point.as_dict() for point in self.points]}


def read_curve(source: CurveSource) -> Curve:
    """Read the evaluations of a training's checkpoints that are there: `STEP/metrics.jsonl` or `STEP.jsonl`.

    Raises:
        DatasetError: A metrics file cannot be used.
    """
    folder = Path(source.folder)
    files = {
        int(path.parent.name): path
        for path in folder.glob("[0-9]*/metrics.jsonl")
        if path.parent.name.isdigit()
    }
    files |= {int(path.stem): path for path in folder.glob("[0-9]*.jsonl")}
    points = tuple(_point(step, files[step]) for step in sorted(files))
    return Curve(label=source.label, name=folder.name, points=points)


def _point(step: int, metrics: Path) -> CurvePoint:
    evaluation = read_evaluation(metrics)
    episodes = list(evaluation.episodes.values())
    training = read_provenance(metrics).training
    return CurvePoint(
        step=step,
        minutes=training.minutes if training else None,
        scene_set=episodes[0].scene_set,
        n=len(episodes),
        success=wilson_interval(sum(episode.is_success for episode in episodes), len(episodes)),
        metrics=metrics,
    )
