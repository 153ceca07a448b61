"""Record what the environments do under fixed actions, or compare two such records bit by bit.

A change that should not change the simulation is checked with it:

    python bench/compare_traces.py record before.npz      # on the code before the change
    python bench/compare_traces.py record after.npz       # on the code after it
    python bench/compare_traces.py before.npz after.npz   # exit code 1 if anything differs

A record holds, for every case below and every frame: the action (of the scripted operator, or drawn from a seed), a
digest of every picture, `agent_pos`, reward, flags, success, task state and command; and the metrics at the end.
"""

import hashlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import lerobot_excav.envs  # noqa: F401 - registers the environments
from lerobot_excav.envs.tasks.registry import task_spec

SCOOP, GRASP = "Scoop-v0", "FR5Grasp-v0"

# Name, task, who acts, how many frames at most, scene, target, settings. Other soils, frame rates, masks and sizes than
# the defaults, because those are what a careless change breaks.
CASES: tuple[tuple[str, str, str, int, int, int, dict[str, Any]], ...] = (
    ("scoop-operator", SCOOP, "operator", 250, 7, 3, {"scene_set": "test"}),
    ("scoop-random", SCOOP, "random", 40, 11, 1, {"mask_condition": "mismatched"}),
    ("scoop-dirt", SCOOP, "random", 30, 4, 0, {"soil": "dirt", "mask_noise": "dilate", "mask_noise_px": 2, "fps": 25}),
    ("scoop-gravel", SCOOP, "operator", 250, 2, 2, {"soil": "gravel", "fidelity": "fast", "obs_type": "agent_pos"}),
    ("scoop-short", SCOOP, "random", 12, 3, 1, {"mask_condition": "random", "episode_length": 12, "scene_set": "val"}),
    ("grasp-operator", GRASP, "operator", 400, 5, 2, {"scene_set": "test"}),
    ("grasp-retarget", GRASP, "operator", 400, 6, 1, {"retarget_frame": 60, "mask_condition": "mismatched"}),
    ("grasp-random", GRASP, "random", 40, 8, 0, {"retarget_frame": 15, "episode_length": 40}),
    ("grasp-noise", GRASP, "random", 30, 9, 3, {"mask_noise": "shift", "mask_noise_px": 4, "fps": 25}),
    (
        *("grasp-blind", GRASP, "random", 60, 1, 1),
        {"obs_type": "agent_pos", "mask_condition": "zero", "episode_length": 60},
    ),
    ("grasp-large", GRASP, "random", 5, 1, 1, {"observation_height": 144, "observation_width": 192}),
)


def record(path: Path) -> None:
    """Play all cases and write what happened to a file."""
    arrays: dict[str, Any] = {}
    for name, task, actor, frames, scene_id, target_id, settings in CASES:
        env = gym.make(f"lerobot_excav/{task}", disable_env_checker=True, **settings).unwrapped
        observation, info = env.reset(seed=3, options={"scene_id": scene_id, "target_id": target_id})
        rows = [_row(observation, info, 0.0, (False, False))]
        actions, metrics = [], {}
        for action in _actions(actor, task, env, frames):
            observation, reward, terminated, truncated, info = env.step(action)
            actions.append(action)
            rows.append(_row(observation, info, reward, (terminated, truncated)))
            metrics = info.get("episode_metrics", {})
            if terminated or truncated:
                break
        env.close()
        arrays[f"{name}/action"] = np.array(actions)
        arrays[f"{name}/metrics"] = np.array(json.dumps(metrics, default=_plain))
        for key in rows[0]:
            arrays[f"{name}/{key}"] = np.array([row[key] for row in rows])
        print(f"{name}: {len(actions)} frames", flush=True)
    np.savez(path, **arrays)


def _actions(actor: str, task: str, env: Any, frames: int) -> Iterator[Any]:
    if actor == "operator":
        operator = task_spec("task", task).make_operator(np.random.default_rng(5))
        operator.reset(env)
        for _ in range(frames):
            yield operator.act(env)
        return
    rng, space = np.random.default_rng(1), env.action_space
    middle, half = 0.5 * (space.high + space.low), 0.5 * (space.high - space.low)
    wish = np.zeros(space.shape)
    for _ in range(frames):
        # A random walk, beyond the limits at times: it digs, hits and is clipped.
        wish = np.clip(wish + rng.normal(0.0, 0.4, space.shape), -1.2, 1.2)
        yield (middle + half * wish).astype(np.float32)


def _row(observation: dict[str, Any], info: dict[str, Any], reward: float, flags: tuple[bool, bool]) -> dict[str, Any]:
    pixels = observation.get("pixels", {})
    return {
        "agent_pos": observation["agent_pos"],
        "pixels": " ".join(f"{k}:{hashlib.sha256(v.tobytes()).hexdigest()[:16]}" for k, v in sorted(pixels.items())),
        "reward": float(reward),
        "flags": [*flags, bool(info["is_success"])],
        "task_state": info["task_state"],
        "command": [info["scene_id"], info["target_id"]],
    }


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else str(value)


def compare(first: Path, second: Path) -> list[str]:
    """Return what differs between two records, in words; metrics that only one of them has do not count."""
    a, b = np.load(first), np.load(second)
    problems = [f"{key}: only in one record" for key in sorted(set(a.files) ^ set(b.files))]
    for key in sorted(set(a.files) & set(b.files)):
        problems += _metric_differences(key, a, b) if key.endswith("/metrics") else _differences(key, a[key], b[key])
    return problems


def _metric_differences(key: str, a: Any, b: Any) -> list[str]:
    first, second = json.loads(str(a[key])), json.loads(str(b[key]))
    unlike = [n for n in first.keys() & second.keys() if repr(first[n]) != repr(second[n])]
    return [f"{key}: {name} is {first[name]} and {second[name]}" for name in sorted(unlike)]


def _differences(key: str, a: Any, b: Any) -> list[str]:
    if (a.shape, a.dtype.kind) != (b.shape, b.dtype.kind) or (a.dtype != b.dtype and a.dtype.kind != "U"):
        return [f"{key}: {a.dtype} {a.shape} and {b.dtype} {b.shape}"]
    same = (a == b) | ((a != a) & (b != b))
    if a.dtype.kind == "f":
        same &= np.signbit(a) == np.signbit(b)
    if same.all():
        return []
    frame = int(np.argmin(same.reshape(len(a), -1).all(axis=1)))
    return [f"{key}: differs from frame {frame} on: {a[frame]} and {b[frame]}"]


def main(arguments: list[str]) -> int:
    """Run the command line."""
    if len(arguments) != 2:
        print(__doc__)
        return 2
    if arguments[0] == "record":
        if Path(arguments[1]).exists():
            print(f"{arguments[1]} exists; choose another file, or remove it first")
            return 2
        record(Path(arguments[1]))
        return 0
    problems = compare(*map(Path, arguments))
    print("\n".join(problems) or "bit-equal")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
