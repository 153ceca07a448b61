"""Write into a recording of the test bed how old what was seen was in every frame, and count the frames that were late.

The result is a new dataset with the columns excav.image_age_ms, excav.state_age_ms, excav.is_causal and
excav.is_as_told; all else stays as it is. Exit code 0 if every frame is within its limits and the machine did what the
actions say, 1 if not.

Examples:
  lerobot-excav alignment outputs/driven --log=outputs/driven_alignment.jsonl --out=outputs/driven_aligned
      after lerobot-record --robot.type=excavator_testbed --robot.alignment_log=outputs/driven_alignment.jsonl ...
"""

from dataclasses import dataclass
from pathlib import Path

from lerobot_excav.scripts.qc import DatasetArguments
from lerobot_excav.setting import setting


@dataclass(kw_only=True)
class AlignmentArguments(DatasetArguments):
    """Arguments of `lerobot-excav alignment`."""

    log: Path | None = setting("Alignment log that the robot wrote while it was recorded", default=None)
    out: Path | None = setting("Folder of the new dataset; must not exist", default=None)


def run(arguments: AlignmentArguments) -> int:
    """Write the columns, and tell what they say."""
    from lerobot_excav.datasets.alignment.aligned_copy import write_aligned_copy
    from lerobot_excav.robots.excavator_testbed.alignment import IMAGE_LIMIT_MS, STATE_LIMIT_MS

    log = arguments.given("log", "the robot's alignment_log, such as --log=outputs/driven_alignment.jsonl")
    out = arguments.given("out", "the folder of the new dataset, such as --out=outputs/aligned")
    counts = write_aligned_copy(arguments.root, out, log=log)
    share = counts.late_frames / counts.frames
    print(f"{counts.late_frames} of {counts.frames} frames ({share:.1%}) saw something too old when they acted")
    oldest = "of unknown age" if counts.worst_image_ms < 0 else f"{counts.worst_image_ms:.0f} ms"
    print(f"  oldest picture {oldest}, of {IMAGE_LIMIT_MS:.0f} ms allowed")
    print(f"  oldest state   {counts.worst_state_ms:.0f} ms, of {STATE_LIMIT_MS:.0f} ms allowed")
    if counts.late_episodes:
        print(f"  in episodes {', '.join(map(str, counts.late_episodes))}")
    print(f"{counts.other_frames} of {counts.frames} frames: the machine did something else than the action says")
    print(f"{out}: do not train on frames in which excav.is_causal or excav.is_as_told is false")
    return int(counts.late_frames > 0 or counts.other_frames > 0)


ARGUMENTS = AlignmentArguments
