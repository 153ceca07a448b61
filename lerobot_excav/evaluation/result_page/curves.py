"""Success against training: evaluations of several checkpoints of one training."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.provenance import EvaluationOrigin
from lerobot_excav.evaluation.result_page.contents import CurveSource
from lerobot_excav.evaluation.run import Run
from lerobot_excav.evaluation.statistics import Interval, wilson_interval


@dataclass(frozen=True, kw_only=True)
class CurvePoint:
    """Success of the checkpoint of one training step: its rate in scenes of one set, and where that comes from."""

    step: int
    run: Run
    origin: EvaluationOrigin
    success: Interval

    @property
    def minutes(self) -> float | None:
        """Training time up to the checkpoint [min]; None if no log tells."""
        return self.origin.training.minutes if self.origin.training else None

    @property
    def scene_set(self) -> str:
        """Scenes that it played."""
        return self.run.episodes[0].scene_set

    @property
    def n(self) -> int:
        """Episodes."""
        return len(self.run.episodes)

    def as_dict(self) -> dict[str, Any]:
        """Return the point as plain data."""
        known = {"step": self.step, "minutes": self.minutes, "scene_set": self.scene_set, "n": self.n}
        return {**known, "success": asdict(self.success)}


@dataclass(frozen=True, kw_only=True)
class SuccessCurve:
    """Success of the checkpoints of one training, by their step; `label` names it in the plot."""

    label: str
    name: str
    points: tuple[CurvePoint, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the curve as plain data."""
        return {"label": self.label, "name": self.name, "points": [point.as_dict() for point in self.points]}


def read_curve(source: CurveSource) -> SuccessCurve:
    """Read the evaluations of a training's checkpoints that are there: `STEP/metrics.jsonl` or `STEP.jsonl`.

    Raises:
        ConfigurationError: An evaluation mixes conditions.
        DatasetError: A metrics file cannot be used, or the checkpoints played different sets of scenes or conditions.
    """
    folder = Path(source.folder)
    named = [(path.parent.name, path) for path in folder.glob("*/metrics.jsonl")]
    named += [(path.stem, path) for path in folder.glob("*.jsonl")]
    files = {int(step): path for step, path in named if step.isdigit()}
    points = tuple(_point(step, files[step]) for step in sorted(files))
    for point in points:
        _require_alike(points[0], point)
    return SuccessCurve(label=source.label, name=folder.name, points=points)


def _point(step: int, metrics: Path) -> CurvePoint:
    run = Run(label=str(metrics), evaluations=(read_evaluation(metrics),))
    sets = sorted({episode.scene_set for episode in run.episodes})
    if len(sets) > 1:
        raise DatasetError(f"{metrics} mixes scenes of {' and '.join(sets)}; a point of a curve is of one set")
    return CurvePoint(
        step=step,
        run=run,
        origin=EvaluationOrigin.read(metrics),
        success=wilson_interval(sum(episode.is_success for episode in run.episodes), len(run.episodes)),
    )


def _require_alike(first: CurvePoint, point: CurvePoint) -> None:
    """Raise `DatasetError` unless two checkpoints played one task in scenes of one set under equal conditions."""
    played = [{"task": p.run.task, "scene_set": p.scene_set, **p.run.constants} for p in (first, point)]
    for name, value in played[0].items():
        if played[1].get(name) != value:
            raise DatasetError(
                f"{first.run.first.path} has {name}={value!r} and {point.run.first.path} {played[1].get(name)!r}; "
                "the points of a curve differ in their training only: put them into folders of their own"
            )
