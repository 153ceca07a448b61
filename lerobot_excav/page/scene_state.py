"""What the page tells of an environment: its scene, its targets, its task, its sticks."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.sticks import Legend
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.target_marks import Mark


def scene_state(
    env: MaskedTaskEnv[Any, Any],
    seat: DriversSeat,
    *,
    legend: Legend,
    marks: Sequence[Mark],
    sticks_number: int,
    acted: NDArray[np.float32] | None,
) -> dict[str, Any]:
    """Return what the page shows of an environment whose episode has begun, ready for JSON.

    Args:
        env: The environment.
        seat: Who drives it.
        legend: What the sticks do.
        marks: Where its targets lie in the picture.
        sticks_number: Number of the message of the sticks that acted in the frame that is shown.
        acted: The last action; None if there was none.
    """
    spec, caption = env.task_spec, env.caption
    axes, _ = seat.axes()
    action = env.holding_action() if acted is None else acted
    return {
        "task": spec.id,
        "task_description": spec.description,
        "scene": {"set": env.settings.scene_set, "scene_id": env.scene_id, "stage": env.stage},
        "last_stage": spec.last_stage,
        "ready": seat.sticks.is_ready,
        "axes": axes,
        "sticks_number": sticks_number,
        "legend": legend,
        "action": dict(zip(spec.action_names, np.round(np.asarray(action, float), 3).tolist(), strict=True)),
        "measured": list(caption.words),
        "outcome": caption.outcome,
        "success": caption.is_success,
        "over": env.is_over,
        "task_state": dict(zip(spec.task_state_names, np.round(env.task_state.astype(float), 3).tolist(), strict=True)),
        "targets": list(marks),
        "target": env.target_id,
        "mask_source": None if env.mask is None else env.mask.source,
        "frame": env.frame,
        "fps": env.fps,
    }
