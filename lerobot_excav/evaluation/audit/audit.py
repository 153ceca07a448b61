"""An audit as a whole: play what is missing, then measure and judge."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.datasets.record.progress import EpisodeProgress
from lerobot_excav.datasets.record.workers import episode_results, submit_episodes, worker_pool
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.audit.actor import policy_config, require_same_machine
from lerobot_excav.evaluation.audit.branch import Branch
from lerobot_excav.evaluation.audit.obedience import Obedience, obedience
from lerobot_excav.evaluation.audit.scene_branches import audit_scene, read_scene
from lerobot_excav.evaluation.audit.separation import Separation, separation
from lerobot_excav.evaluation.audit.settings import MOMENTS, OPERATOR, AuditSettings
from lerobot_excav.evaluation.audit.verdict import Verdict, judge
from lerobot_excav.run_lock import RunLock
from lerobot_excav.whole_file import write_whole

SETTINGS = "settings.json"


@dataclass(frozen=True, kw_only=True)
class Audit:
    """What an audit found, by the labels of who acted.

    Attributes:
        settings: What was played.
        branches: Every branch.
        obedience: How places follow masks that are given at the start.
        verdicts: What that comes to.
        separation: By label and moment, how far masks drive actions and tool apart.
    """

    settings: AuditSettings
    branches: Mapping[str, list[Branch]]
    obedience: Mapping[str, Obedience]
    verdicts: Mapping[str, Verdict]
    separation: Mapping[str, Mapping[str, Separation]]

    def as_dict(self) -> dict[str, Any]:
        """Return everything but the branches as plain data."""
        return {
            "settings": self.settings.as_record(),
            "scenes": list(self.settings.scene_ids),
            "fps": self.settings.env.fps,
            "verdicts": {label: asdict(verdict) for label, verdict in self.verdicts.items()},
            "obedience": {label: asdict(found) for label, found in self.obedience.items()},
            "separation": {
                label: {moment: asdict(curves) for moment, curves in by_moment.items()}
                for label, by_moment in self.separation.items()
            },
        }


def play_audit(settings: AuditSettings, folder: Path, *, workers: int, show_progress: bool = True) -> None:
    """Play the scenes that a folder does not hold yet; every finished scene is a file in it.

    Raises:
        ConfigurationError: A policy cannot be used as asked for, or the folder holds scenes of other settings.
        DatasetError: Another process is at it, or a file is damaged.
        ExcavError: A scene could not be played.
    """
    require_policies(settings)
    folder.mkdir(parents=True, exist_ok=True)
    lock = RunLock(folder / ".lock", folder)
    try:
        _require_same(settings, folder / SETTINGS)
        with worker_pool(workers) as pool, EpisodeProgress(settings.scenes, show=show_progress) as progress:
            futures = [
                submit_episodes(pool, progress, audit_scene, settings, scene_id, folder)
                for scene_id in settings.scene_ids
            ]
            for future in futures:
                episode_results(future)
    finally:
        lock.release()


def require_policies(settings: AuditSettings) -> None:
    """Check that all policies are there, are of the machine, and can plan as asked for.

    Raises:
        ConfigurationError: One is not, or cannot.
    """
    for variant in settings.variants:
        if variant.checkpoint is not None:
            require_same_machine(policy_config(variant.checkpoint, variant.overrides), settings.env)


def read_audit(settings: AuditSettings, folder: Path, *, seed: int = 0) -> Audit:
    """Measure and judge what was played; `seed` is that of the bootstrap.

    Raises:
        DatasetError: A file is missing or damaged.
    """
    scenes = [read_scene(folder, scene_id) for scene_id in settings.scene_ids]
    labels = [variant.label for variant in settings.variants]
    branches = {label: [b for scene in scenes for b in scene.branches[label]] for label in labels}
    starts = {label: [b for b in found if b.moment == MOMENTS[0]] for label, found in branches.items()}
    rng = np.random.default_rng(seed)
    found = {label: obedience(starts[label], starts[OPERATOR], rng) for label in labels}
    return Audit(
        settings=settings,
        branches=branches,
        obedience=found,
        verdicts={label: judge(obeyed) for label, obeyed in found.items()},
        separation={
            variant.label: {
                moment: separation([b for b in branches[variant.label] if b.moment == moment])
                for moment in variant.moments
            }
            for variant in settings.variants
        },
    )


def _require_same(settings: AuditSettings, path: Path) -> None:
    """Check the settings of earlier scenes, or keep those of the first."""
    record = json.loads(json.dumps(settings.as_record()))
    if not path.exists():
        write_whole(path, json.dumps(record, indent=1) + "\n")
        return
    with reading(path):
        theirs = json.loads(path.read_text(encoding="utf-8"))
    for name, mine in record.items():
        # A setting that was not there yet was at its default.
        if mine != theirs.get(name, getattr(type(settings.env), name.removeprefix("env."), None)):
            raise ConfigurationError(
                f"{path.parent} holds scenes of another audit: {name} is {theirs.get(name)!r} there, and {mine!r} is "
                "asked for; give the same options, or choose another --out"
            )
