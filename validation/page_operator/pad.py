"""A gamepad that is not there: it holds its sticks as they are planned for the frame that the page shows."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv

DEAD_ZONE = 0.08
"""That of the page, until a person sets another."""

STUBBED_PAD = """
window.pads = [{index: 0, id: "Stub (test)", connected: true, mapping: "standard", buttons: [],
  get axes() {
    const frame = Number(document.body?.dataset.frame ?? 0);
    return window.plan?.[frame] ?? window.axes ?? [0, 0, 0, 0];
  }}];
Object.defineProperty(navigator, "getGamepads", {value: () => window.pads});
"""
"""For the page: its axes are those of `window.axes`, or of `window.plan` for the frame that is shown."""


class Plan(NamedTuple):
    """A cycle of the operator, without a page."""

    sticks: list[list[float]]  # per frame, from the first motion on: left x and y, right x and y
    is_success: bool


def axes_of(action: NDArray[Any]) -> list[float]:
    """Return the ISO sticks that ask for an action (4,): swing, boom, arm, bucket."""
    swing, boom, arm, bucket = (float(value) for value in action)
    return [-swing, -arm, bucket, boom]


def undone(axes: list[float]) -> list[float]:
    """Return deflections that the page's dead zone turns into the given axes."""
    return [float(np.sign(a) * (DEAD_ZONE + (1.0 - DEAD_ZONE) * abs(a))) if abs(a) > 1e-6 else 0.0 for a in axes]


def planned(env: MaskedTaskEnv[Any, Any], *, seed: int = 0, **start: int) -> Plan:
    """Let the scripted operator play a cycle from a start; time stands still on the page until the first motion."""
    env.reset(options=dict(start))
    operator = env.task_spec.make_operator(np.random.default_rng(seed))
    operator.reset(env)
    sticks, is_over, info = list[list[float]](), False, dict[str, Any]()
    while not is_over:
        action = operator.act(env)
        sticks.append(undone(axes_of(action)))
        _, _, terminated, truncated, info = env.step(action)
        is_over = terminated or truncated
    moved = next(frame for frame, axes in enumerate(sticks) if any(axes))
    return Plan(sticks[moved:], bool(info["is_success"]))
