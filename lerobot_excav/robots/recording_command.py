"""The command of LeRobot that drives a robot: whether its rate and its storage suit a simulation with a mask.

The command's configuration exists before the robot is made, and the robot is made before the dataset's folder, so a
refused command leaves nothing behind.
"""

import json
import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from lerobot.configs.dataset import DatasetRecordConfig
from lerobot.utils.constants import HF_LEROBOT_HOME

from lerobot_excav.envs.holder import holder_of
from lerobot_excav.envs.masks.video import LOSSLESS_CODEC, LOSSLESS_PIX_FMTS, keeps_masks
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.testbed.picture_stream import FARTHEST_M

LOSSLESS_FLAGS = (
    f"--dataset.rgb_encoder.vcodec={LOSSLESS_CODEC} --dataset.rgb_encoder.pix_fmt={LOSSLESS_PIX_FMTS[0]} "
    "--dataset.rgb_encoder.crf=0"
)

UNLOGGED_STRATEGIES = ("highlight", "dagger")
"""Rollouts whose episodes begin anywhere within a run, and not with a reset."""

logger = logging.getLogger(__name__)


def require_fitting_command(robot_config: Any) -> Any | None:
    """Check that the command gives the robot one action per frame, and stores the mask as it is.

    A warning tells of a rollout that the session log cannot describe. Returns the configuration of the command, or None
    if no command of LeRobot made the robot.

    Raises:
        ConfigurationError: It does not; the message holds the flags to add.
    """
    command = holder_of(robot_config, "robot")
    if command is None:
        return None
    faults = [*_wrong_rates(command, robot_config.fps), *_blurred_mask(command)]
    _require_none(faults, f"this command and robot.fps={robot_config.fps} do not fit")
    strategy = getattr(getattr(command, "strategy", None), "type", None)
    if strategy in UNLOGGED_STRATEGIES:
        logger.warning(
            f"--strategy.type={strategy} begins its episodes within a run, so the session log does not hold them and "
            "`lerobot-excav index` cannot add the excav.* columns. --strategy.type=episodic and sentry are logged."
        )
    return command


def require_command_for_machine(
    robot_config: Any, *, rates: Sequence[int], has_mask: bool, has_depth: bool = False
) -> None:
    """Check that the command drives a machine at one of its rates, and stores its mask, if it has one, as it is.

    Raises:
        ConfigurationError: It does not; the message holds the flags to add.
    """
    command = holder_of(robot_config, "robot")
    if command is None:
        return
    faults = [*_rates_beside(command, rates), *(_blurred_mask(command) if has_mask else ())]
    faults += _cut_depth(command) if has_depth else ()
    takes = f"takes {', '.join(map(str, rates))} actions a second"
    _require_none(faults, f"this command does not fit the machine, which {takes}")


def operator_of(command: Any) -> str | None:
    """Return who commands by a command of LeRobot, `policy` or `person`; a scripted operator says so itself."""
    if hasattr(command, "strategy"):  # lerobot-rollout
        return "policy"
    return "person" if getattr(command, "teleop", None) is not None else None


def recorded_text(command: Any) -> str | None:
    """Return the task text that the command gives every frame that it records, or None if it records nothing."""
    return getattr(recorded_dataset(command), "single_task", None)


def recorded_dataset(command: Any) -> Any | None:
    """Return how the command records, or None if it does not."""
    dataset = getattr(command, "dataset", None)
    return dataset if isinstance(dataset, DatasetRecordConfig) else None


def _require_none(faults: Sequence[tuple[str, str]], words: str) -> None:
    """Raise `ConfigurationError` if there are faults, each with the flag that mends it; `words` say of what."""
    if faults:
        raise ConfigurationError(
            f"{words}: {'; '.join(fault for fault, _ in faults)}. Nothing was recorded or moved. "
            f"Give {' '.join(flag for _, flag in faults)}"
        )


def _times(command: Any) -> int:
    """Return how many actions are sent for one of a policy; a recording has to have one."""
    return 1 if recorded_dataset(command) is not None else getattr(command, "interpolation_multiplier", 1)


def _repeated_observations(command: Any) -> Iterator[tuple[str, str]]:
    """Yield a multiplier that would store an observation several times, and the flag that mends it."""
    times = getattr(command, "interpolation_multiplier", 1)
    if times != 1 and recorded_dataset(command) is not None:
        yield (
            f"--interpolation_multiplier={times} stores every observation {times} times",
            "--interpolation_multiplier=1",
        )


def _wrong_rates(command: Any, fps: int) -> Iterator[tuple[str, str]]:
    """Yield every rate of the command that is not the robot's, in words, and the flag that mends it."""
    if hasattr(command, "fps"):
        yield from _repeated_observations(command)
        times = _times(command)
        if command.fps * times != fps:
            words = f" and --interpolation_multiplier={times}" * (times != 1)
            yield (
                f"--fps={command.fps:g}{words} sends {command.fps * times:g} actions a second, each of which "
                f"moves the simulation by 1/{fps} s",
                f"--fps={fps / times:g}",
            )
    recorded = recorded_dataset(command)
    if recorded is not None and recorded.fps != fps:
        yield (
            f"--dataset.fps={recorded.fps} would tell the dataset of {recorded.fps} frames a second",
            f"--dataset.fps={fps}",
        )
    replayed = _replayed_rate(command)
    if replayed not in (None, fps):
        yield f"the dataset was recorded at {replayed} frames a second", f"--robot.fps={replayed}"


def _rates_beside(command: Any, rates: Sequence[int]) -> Iterator[tuple[str, str]]:
    """Yield every rate of the command that does not fit a machine or its own recording, and the flag that mends it."""
    fps, times, recorded = getattr(command, "fps", None), _times(command), recorded_dataset(command)
    if fps is not None:
        yield from _repeated_observations(command)
    if fps is not None and fps * times not in rates:
        yield f"it sends {fps * times:g}", _mended_rate(fps, times, rates)
    if recorded is not None and recorded.fps not in rates:
        yield f"it records {recorded.fps} frames a second", f"--dataset.fps={_nearest(recorded.fps, rates)}"
    elif recorded is not None and fps is not None and recorded.fps != fps:
        yield f"it records {recorded.fps} frames a second of {fps:g} that pass", f"--dataset.fps={fps:g}"
    replayed = _replayed_rate(command)
    if replayed is not None and replayed not in rates:
        yield f"the dataset was recorded at {replayed} frames a second", "a recording at one of its rates"


def _mended_rate(fps: float, times: int, rates: Sequence[int]) -> str:
    """Return the flags that bring a command to one of the rates; that of a policy stays if there is a way."""
    fitting = [each for each in range(1, max(rates) + 1) if fps * each in rates]
    if fitting:
        return f"--interpolation_multiplier={_nearest(times, fitting)}"
    return f"--fps={_nearest(fps * times, rates)}" + " --interpolation_multiplier=1" * (times != 1)


def _nearest(rate: float, rates: Sequence[int]) -> int:
    return min(rates, key=lambda each: abs(each - rate))


def _blurred_mask(command: Any) -> Iterator[tuple[str, str]]:
    recorded = recorded_dataset(command)
    if recorded is None or not recorded.video:
        return
    encoder = recorded.rgb_encoder
    if not keeps_masks(encoder.vcodec, encoder.crf, encoder.pix_fmt):
        yield (
            f"--dataset.video=true with vcodec={encoder.vcodec}, pix_fmt={encoder.pix_fmt} and crf={encoder.crf} "
            "blurs the target mask, and `lerobot-excav index` refuses such a recording",
            f"--dataset.video=false (or, for training with long chunks, {LOSSLESS_FLAGS})",
        )


def _cut_depth(command: Any) -> Iterator[tuple[str, str]]:
    """Yield a range of recorded depth that ends before the dig area does, and the flag that mends it."""
    recorded = recorded_dataset(command)
    if recorded is not None and recorded.video and recorded.depth_encoder.depth_max < FARTHEST_M:
        yield (
            f"--dataset.depth_encoder.depth_max={recorded.depth_encoder.depth_max:g} cuts off what is farther away [m]",
            f"--dataset.depth_encoder.depth_max={FARTHEST_M:g}",
        )


def _replayed_rate(command: Any) -> int | None:
    """Return the frame rate of the dataset that the command plays again, if it does and the dataset is here."""
    dataset = getattr(command, "dataset", None)
    if dataset is None or not hasattr(dataset, "episode"):
        return None
    info = Path(dataset.root or HF_LEROBOT_HOME / dataset.repo_id, "meta", "info.json")
    try:
        rate: int | None = json.loads(info.read_text(encoding="utf-8")).get("fps")
    except (OSError, ValueError, AttributeError):
        return None  # LeRobot says what is wrong with it
    return rate
