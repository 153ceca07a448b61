"""Checks of one recorded episode that need no simulation."""

import re
from collections.abc import Iterator, Sequence

import numpy as np

from lerobot_excav.datasets.format.episode_table import EpisodeTable
from lerobot_excav.datasets.format.schema import (
    COMMAND_KEY,
    INTERVENTION_KEY,
    MASK_KEY,
    MASK_SOURCE_KEY,
    OPERATOR_KEY,
    OPERATORS,
    PAIR_KEY,
    REST_KEY,
    SCENE_KEY,
    SIMULATION_KEY,
    STAGE_KEY,
    TARGET_KEY,
    camera_key,
)
from lerobot_excav.envs.masks.corrupted import MASK_CONDITIONS, MASK_NOISES
from lerobot_excav.envs.tasks.settings import LAST_SCENE, SCENE_SETS, SNAPPED
from lerobot_excav.errors import ConfigurationError, DatasetError

MAIN_KEY = camera_key("main")
OVERLAY = "as overlay"
"""How `excav.mask_source` says that the mask is tinted into the main view."""

FIRST_IMAGE_TOLERANCE = 2
"""Grey levels by which the first pictures of a scene may differ; graphics cards round differently (guess)."""

ACTION_MARGIN = 0.1
"""Share of its range by which an action may lie outside of it: `lerobot-rollout` records what the policy asked for, and
environments clip it. More speaks of another unit (guess)."""


MOST_REST_FRAMES = 100_000
"""As many as a demonstration may have at all."""

MASK_WORDS = re.compile(
    rf"[^,]+(, ({'|'.join(MASK_CONDITIONS[1:])}))?(, ({'|'.join(MASK_NOISES[1:])}) [1-9][0-9]* px)?"
    rf"(, {SNAPPED})?(, dropout [0-9.e-]+ %)?(, {OVERLAY})?"
)
"""What `TaskSettings.mask_words` can be; a source may be of a package that is not installed here."""


def fact_problems(episode: EpisodeTable) -> Iterator[str]:
    """Describe in plain words which facts of an episode, that have all columns, contradict each other or cannot be."""
    for find in (
        *(_task_problems, _version_problems, _pair_problems, _command_problems),
        *(_setting_problems, _mask_word_problems, _outcome_problems, _operator_problems),
    ):
        try:
            yield from find(episode)
        except DatasetError as contradiction:
            yield str(contradiction).removeprefix(f"episode {episode.index}: ")
            if find is _task_problems:
                return


def _task_problems(episode: EpisodeTable) -> Iterator[str]:
    _ = episode.spec  # one, and of this robot
    yield from ()


def _command_problems(episode: EpisodeTable) -> Iterator[str]:
    frames = np.arange(episode.length)
    since, starts = episode.array(COMMAND_KEY), np.zeros(episode.length, dtype=bool)
    starts[0], starts[1:] = True, np.diff(since) != 0
    if (wrong := starts & (since != frames)).any():
        frame = int(np.argmax(wrong))
        yield f"{COMMAND_KEY}={since[frame]} at frame {frame}, where a command begins; it has to be {frame}"
    elif (wrong := ~starts[1:] & (np.diff(episode.target_id) != 0)).any():
        frame = 1 + int(np.argmax(wrong))
        yield f"{TARGET_KEY} changes at frame {frame}, though by {COMMAND_KEY} no command begins there"


def _version_problems(episode: EpisodeTable) -> Iterator[str]:
    version, known = episode.simulation_version, episode.spec.changes
    if version not in known:
        yield f"{SIMULATION_KEY}={version} is not known; this package knows the versions up to {max(known)}"


def _pair_problems(episode: EpisodeTable) -> Iterator[str]:
    pair, targets = episode.pair, episode.spec.target_count
    if pair.scene_set not in SCENE_SETS:
        yield f"{PAIR_KEY}={pair.uid!r} has an unknown scene set; allowed: {', '.join(SCENE_SETS)}"
    if pair.scene_id > LAST_SCENE:
        yield f"{SCENE_KEY}={pair.scene_id} is not possible; the last scene is {LAST_SCENE}"
    if not 0 <= pair.stage <= (last := episode.spec.last_stage):
        yield f"{STAGE_KEY}={pair.stage} is not possible; the last stage is {last}"
    wrong = [target for target in np.unique(episode.target_id).tolist() if not 0 <= target < targets]
    if wrong:
        yield f"{TARGET_KEY}={wrong[0]} is not possible; allowed are 0 to {targets - 1}"


def _setting_problems(episode: EpisodeTable) -> Iterator[str]:
    try:
        episode.spec.make_settings(**episode.settings)
    except ConfigurationError as error:
        yield f"excav.{error}"


def _mask_word_problems(episode: EpisodeTable) -> Iterator[str]:
    if not MASK_WORDS.fullmatch(episode.mask_words):
        yield f"{MASK_SOURCE_KEY}={episode.mask_words!r} is not possible; such as 'oracle, shift 2 px, {OVERLAY}' is"


def _outcome_problems(episode: EpisodeTable) -> Iterator[str]:
    _ = episode.success, episode.outcome  # one per episode
    most = MOST_REST_FRAMES if episode.spec.cuts_rest else 0
    if not 0 <= episode.rest_frames <= most:
        yield f"{REST_KEY}={episode.rest_frames} is not possible; allowed are 0 to {most}"


def _operator_problems(episode: EpisodeTable) -> Iterator[str]:
    if episode.operator not in OPERATORS:
        yield f"{OPERATOR_KEY}={episode.operator!r:.100} is not known; allowed: {', '.join(OPERATORS)}"
    elif episode.operator != "policy" and episode.intervention.any():
        frame = int(np.argmax(episode.intervention))
        yield (
            f"{INTERVENTION_KEY} is true at frame {frame}, though {OPERATOR_KEY}={episode.operator!r}: there was no "
            "policy to take over from"
        )


def action_problems(episode: EpisodeTable) -> Iterator[str]:
    """Describe in plain words which actions are outside of their limits."""
    names = episode.robot.action_names
    for name, values, low, high in zip(
        names, episode.action.T, episode.robot.action_low, episode.robot.action_high, strict=True
    ):
        margin = ACTION_MARGIN * (high - low)
        outside = values[(values < low - margin) | (values > high + margin)]
        if outside.size:
            worst = outside[np.argmax(np.abs(outside))]
            yield f"action {name} reaches {worst:.3g}; allowed are {low:.3g} to {high:.3g}"


def _picture_of_mask_problems(episode: EpisodeTable, frame: int) -> Iterator[str]:
    mask_img = episode.image(MASK_KEY, frame)
    if not np.isin(mask_img, (0, 255)).all():
        values = np.unique(mask_img)[:4].tolist()
        yield f"the target mask is not binary at frame {frame}: it holds {values}; allowed are 0 and 255"
    elif not mask_img.any() and "zero" not in episode.mask_changes:
        yield f"the target mask is empty from frame {frame} on"


def _flickers(episode: EpisodeTable) -> bool:
    changes = episode.mask_changes
    return SNAPPED not in changes and any(change.startswith("flicker ") for change in changes)


def _missing_masks(episode: EpisodeTable, digests: Sequence[bytes]) -> set[bytes]:
    """Return the digests of empty masks where masks may drop out."""
    if not any(change.startswith("dropout ") for change in episode.mask_changes):
        return set()
    first = {digest: frame for frame, digest in reversed([*enumerate(digests)])}
    return {digest for digest, frame in first.items() if not episode.image(MASK_KEY, frame).any()}


def mask_problems(episode: EpisodeTable) -> Iterator[str]:
    """Check the mask under each command: it is binary, marks something, and changes with the command and then only.

    One that flickers changes at any frame, one that drops out is empty at any, but not at all. Its pictures can be
    decoded.
    """
    starts = [0, *(frame for frame, _ in episode.schedule)]
    digests, targets = episode.image_digests(MASK_KEY), episode.target_id
    missing = _missing_masks(episode, digests)
    if missing and missing == set(digests):
        yield "the target mask is empty in every frame"
    for start, end in zip(starts, [*starts[1:], episode.length], strict=True):
        shown = {digest: frame for frame, digest in reversed([*enumerate(digests)][start:end]) if digest not in missing}
        if len(shown) > 1 and not _flickers(episode):
            yield f"the target mask changes between frames {start} and {end - 1}, though the command does not"
        is_other = start > 0 and targets[start] != targets[start - 1]
        if is_other and digests[start] == digests[start - 1] and not _corruptions(episode):
            yield f"the command changes at frame {start}, though the target mask does not"
        for frame in sorted(shown.values()):
            yield from _picture_of_mask_problems(episode, frame)


def scene_problems(episodes: list[EpisodeTable]) -> dict[int, str]:
    """Compare the starts of the episodes of one scene, which have state, main view and mask.

    Returns:
        Problems by episode index: another initial state or view than the scene's first episode, or the mask of
        another target. Views with an overlay differ from target to target, and corrupted masks show other targets
        or none, so these are not compared.
    """
    problems = {}
    untinted = [episode for episode in episodes if OVERLAY not in episode.mask_changes]
    masks: dict[bytes, int] = {}
    for episode in episodes:
        target = episode.pair.target_id
        if not np.array_equal(episode.state[0], episodes[0].state[0]):
            problems[episode.index] = f"starts in another state than episode {episodes[0].index} of the same scene"
        elif OVERLAY not in episode.mask_changes and _views_differ(episode, untinted[0]):
            problems[episode.index] = f"starts with another view than episode {untinted[0].index} of the same scene"
        elif not _corruptions(episode):
            shown = masks.setdefault(episode.image(MASK_KEY, 0).tobytes(), target)
            if shown != target:
                problems[episode.index] = f"target {target} has the mask of target {shown}"
    return problems


def _corruptions(episode: EpisodeTable) -> frozenset[str]:
    return episode.mask_changes - {OVERLAY}


def _views_differ(one: EpisodeTable, other: EpisodeTable) -> bool:
    difference = one.image(MAIN_KEY, 0).astype(int) - other.image(MAIN_KEY, 0).astype(int)
    return bool(np.abs(difference).max() > FIRST_IMAGE_TOLERANCE)
