"""All branches of a scene, as a worker process plays them."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from lerobot_excav.datasets.format.validated import validated_file
from lerobot_excav.datasets.record.simulation import open_environment
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.selection import TargetAbsentError
from lerobot_excav.errors import DatasetError, ExcavError
from lerobot_excav.evaluation.audit.actor import Actor, OperatorActor, PolicyActor
from lerobot_excav.evaluation.audit.branch import Branch, Prefix, State, play_branch
from lerobot_excav.evaluation.audit.settings import FOLLOWED_S, LEAD_S, MOMENTS, AuditSettings, Variant
from lerobot_excav.whole_file import write_whole


class SceneBranches(BaseModel):
    """The branches of a scene by the labels of who acted."""

    model_config = ConfigDict(strict=True, extra="forbid")

    scene_id: int
    branches: dict[str, list[Branch]]


def scene_file(folder: Path, scene_id: int) -> Path:
    """Return where the branches of a scene are kept."""
    return folder / f"scene_{scene_id:06d}.json"


def read_scene(folder: Path, scene_id: int) -> SceneBranches:
    """Read the branches of a scene.

    Raises:
        DatasetError: The file is damaged.
    """
    return validated_file(SceneBranches, scene_file(folder, scene_id))


def audit_scene(settings: AuditSettings, scene_id: int, folder: Path) -> list[dict[str, Any]]:
    """Play the branches of a scene unless they are kept already; runs in a worker.

    Raises:
        ExcavError: They could not be played; the message names the scene.
    """
    if scene_file(folder, scene_id).exists():
        return [{"success": True}]
    try:
        env = open_environment(settings.env, with_images=True)
        branches = {
            variant.label: list(_variant_branches(env, settings, variant, scene_id)) for variant in settings.variants
        }
    except DatasetError:
        raise
    except ExcavError as error:
        raise ExcavError(f"scene {scene_id}: {error}") from error
    kept = SceneBranches(scene_id=scene_id, branches=branches)
    write_whole(scene_file(folder, scene_id), kept.model_dump_json() + "\n")
    return [{"success": True}]


def _variant_branches(
    env: MaskedTaskEnv[Any, Any], settings: AuditSettings, variant: Variant, scene_id: int
) -> Iterator[Branch]:
    """Play every mask from the start, and, where the variant asks for it, from later moments of one of these plays."""
    actor = _actor(settings, variant, scene_id)
    start = State(scene_id=scene_id, stage=settings.stage)
    target_count = env.task_spec.target_count
    prefix, plays = Prefix(scene_id % target_count), {}
    for target_id in range(target_count):
        with suppress(TargetAbsentError):  # late stages may offer fewer
            record = prefix if target_id == prefix.target_id else None
            plays[target_id] = play_branch(env, actor, start, target_id, record=record)
    yield from plays.values()
    most_frames = round(FOLLOWED_S * env.fps)
    for moment, frame in _later_moments(plays.get(prefix.target_id), variant, env.fps):
        later = replace(start, moment=moment, prefix=prefix, frame=frame)
        for target_id in plays:
            yield play_branch(env, actor, later, target_id, most_frames=most_frames)


def _later_moments(reference: Branch | None, variant: Variant, fps: int) -> list[tuple[str, int]]:
    """Return the later moments of an episode and their frames; none if the tool has not acted in it."""
    if reference is None or reference.began_frame is None:
        return []
    lead = round(LEAD_S * fps)
    frames = {MOMENTS[1]: reference.began_frame - lead, MOMENTS[2]: reference.began_frame + lead}
    last = len(reference.actions) - 2  # an action has to follow a change of the command
    return [(moment, frame) for moment, frame in frames.items() if moment in variant.moments and 0 < frame <= last]


def _actor(settings: AuditSettings, variant: Variant, scene_id: int) -> Actor:
    if variant.checkpoint is None:
        return OperatorActor(settings.seed, scene_id)
    return _policy(variant.checkpoint, variant.overrides)


@lru_cache(maxsize=8)
def _policy(checkpoint: Path, overrides: tuple[str, ...]) -> PolicyActor:
    return PolicyActor(checkpoint, overrides)
