"""Open a page in a browser: see the machine, point, drive, let a policy work, and record demonstrations.

The page is served on this machine alone, at the address that is printed; it holds a token. A gamepad, two joysticks,
keys (W A S D and the arrows) or the page's own sticks drive. With --out episodes are recorded as a LeRobot dataset, the
same one that lerobot-record and `lerobot-excav index` make: every scene with all of its targets. After an interruption
the same command goes on. Ctrl-C ends it.

Examples:
  lerobot-excav console --env.task=Clear-v0 --policy=checkpoints/excavator_mask_act
      point at a place of the pile, and let the policy dig there; take over with the sticks at any moment
  lerobot-excav console --scenes=2 --targets=4 --out=outputs/by_hand
      record 8 paired demonstrations
  lerobot-excav console --scenes=5 --stages=0,4 --out=outputs/stages
      ... of piles as they are drawn and after 4 cycles
  lerobot-excav console --env.type=fr5_grasp
      the arm
  lerobot-excav console --view=outputs/by_hand --episode=3
      look at a recorded episode: the simulation plays its actions again
"""

import webbrowser
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lerobot_excav.datasets.record.demonstration_settings import MOST_SCENES, DemonstrationSettings
from lerobot_excav.envs.tasks.registry import task_settings
from lerobot_excav.envs.tasks.settings import LAST_SCENE, TARGETS_PER_SCENE
from lerobot_excav.errors import require
from lerobot_excav.page.access import Access
from lerobot_excav.page.settings import PageSettings
from lerobot_excav.scripts.arguments import Arguments, EnvironmentChoice
from lerobot_excav.setting import setting

if TYPE_CHECKING:
    from lerobot_excav.console.opening import OpenConsole

HARMLESS_MS = 100
"""Delay up to which the scripted operator of the excavator digs as without one [ms]; see the study."""

DELAY_STUDY = "docs/explanation/rate_and_delay.md"


@dataclass(kw_only=True)
class ConsoleArguments(Arguments, PageSettings):
    """Arguments of `lerobot-excav console`."""

    env: EnvironmentChoice = field(default_factory=EnvironmentChoice.default)
    """Environment, with its settings; the excavator by default."""
    policy: Path | None = setting("pretrained_model folder of a policy that may work", default=None)
    first_scene: int = setting("Number of the first scene", default=0, low=0, high=LAST_SCENE)
    scenes: int = setting("How many scenes are recorded", default=2, low=1, high=MOST_SCENES)
    targets: int | None = setting(
        "Targets recorded per start; left out: 4, and 1 with a task that chooses its targets itself",
        default=None,
        choices=tuple(range(1, TARGETS_PER_SCENE + 1)),
    )
    stages: str = setting(
        "Stages at which every scene is recorded, such as 0,4,8: after so many cycles dug before", default="0"
    )
    view: Path | None = setting(
        "Dataset to look at: the simulation plays a recorded episode again, in its own environment", default=None
    )
    episode: int = setting("With --view: the episode that is shown first", default=0, low=0)
    out: Path | None = setting("Folder of the dataset to record; left out: nothing is recorded", default=None)
    speed: float = setting("How fast the world is beside real time; 0.5 is half as fast", default=1.0, low=0.1, high=4)
    open_browser: bool = setting("Whether to open the page in this machine's browser", default=False)


def run(arguments: ConsoleArguments) -> int:
    """Serve the page until Ctrl-C."""
    from lerobot_excav.console.opening import until_interrupted

    access = arguments.access()
    with until_interrupted() as is_over, _opened(arguments, access) as opened:
        print(f"the console is at {opened.address}", flush=True)
        print("Ctrl-C ends it.", flush=True)
        if arguments.open_browser:
            webbrowser.open(opened.address)
        opened.console.run(is_over)
    print("\n".join(["ended", *delay_words(opened.console.seat.delays_ms, opened.console.env.task_spec.env_type)]))
    return 0


def delay_words(delays_ms: Sequence[float], env_type: str) -> list[str]:
    """Say how long it took from stick to picture [ms], and what is known of such delays; nothing if nobody drove."""
    if not delays_ms:
        return []
    import numpy as np

    median, most = np.percentile(list(delays_ms), [50, 90])
    words = f"stick to picture: {median:.0f} ms in the median, {most:.0f} ms or less in 9 of 10 pictures"
    if env_type != "excavator":
        return [words]
    harm = "as it is here" if most <= HARMLESS_MS else "and here it is more, which costs aim"
    return [words, f"the scripted operator loses nothing up to {HARMLESS_MS} ms, {harm}: {DELAY_STUDY}"]


def _opened(arguments: ConsoleArguments, access: Access) -> AbstractContextManager["OpenConsole"]:
    """Open what was asked for: a console, or the view of a recording."""
    from lerobot_excav.console.opening import open_console
    from lerobot_excav.console.viewing import open_viewer

    shown: dict[str, Any] = {"size": (arguments.height, arguments.width), "speed": arguments.speed}
    require(arguments.view is not None or arguments.episode == 0, f"--episode={arguments.episode} needs --view=DATASET")
    if arguments.view is not None:
        unfit = [name for name in ("policy", "out") if getattr(arguments, name) is not None]
        require(not unfit, f"--view={arguments.view} shows a recording; leave --{' and --'.join(unfit)} out")
        return open_viewer(arguments.view, arguments.episode, access=access, **shown)
    schedule = DemonstrationSettings(
        env=task_settings(arguments.env),
        first_scene=arguments.first_scene,
        scenes=arguments.scenes,
        targets=arguments.targets,
        stages=arguments.stages,
        keep_failures=True,  # whoever drives decides
    )
    return open_console(schedule, access=access, policy=arguments.policy, out=arguments.out, say=print, **shown)


ARGUMENTS = ConsoleArguments
