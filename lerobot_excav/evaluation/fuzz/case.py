"""One case of the fuzz: a soil, a style of actions and some scenes, all of which follow from two numbers."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.settings import ENDLESS_FRAMES, FIDELITIES, SOILS, TARGETS_PER_SCENE
from lerobot_excav.errors import DatasetError, ExcavError
from lerobot_excav.evaluation.fuzz.actions import STYLES, Action
from lerobot_excav.evaluation.fuzz.soundness import SoundnessCheck, reset_problem

_SCENES = 8
"""Scenes are few, since drawing one takes as long as many steps."""

_SHARE_WITH_RESET = 0.5


@dataclass(frozen=True, kw_only=True)
class FuzzCase:
    """What one case is made of; soils, fidelities and styles take turns, the rest is random.

    Attributes:
        seed: Seed of the whole fuzz.
        number: Number of the case in it.
        steps: Environment steps to play.
    """

    seed: int
    number: int
    steps: int

    @property
    def soil(self) -> str:
        """Name of the soil preset."""
        return SOILS[self.number % len(SOILS)]

    @property
    def fidelity(self) -> str:
        """Numerical effort of the soil."""
        return FIDELITIES[self.number // len(SOILS) % len(FIDELITIES)]

    @property
    def style(self) -> str:
        """Style of the actions."""
        styles = tuple(STYLES)
        return styles[self.number // (len(SOILS) * len(FIDELITIES)) % len(styles)]

    def __str__(self) -> str:
        return f"case {self.number} of seed {self.seed} ({self.soil}, {self.fidelity}, {self.style})"


@dataclass(kw_only=True)
class Episode:
    """What was done from one reset to the next.

    Attributes:
        scene_id: Scene of the set `train`.
        target_id: Target.
        actions: Commands, four per step.
    """

    scene_id: int
    target_id: int
    actions: list[list[float]] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class Failure:
    """A case that went wrong, with everything to play it again.

    Attributes:
        case: Its name.
        problem: What was wrong.
        soil: Soil preset.
        fidelity: Numerical effort.
        episodes: What was done; the last action of the last episode led to the problem.
    """

    case: str
    problem: str
    soil: str
    fidelity: str
    episodes: list[Episode]

    @property
    def step(self) -> int:
        """Steps from the last reset to the problem."""
        return len(self.episodes[-1].actions)

    def write(self, path: Path) -> None:
        """Write the failure as JSON; numbers keep every bit."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(self)) + "\n")

    @classmethod
    def read(cls, path: Path) -> "Failure":
        """Read a failure.

        Raises:
            DatasetError: The file is missing or no failure.
        """
        try:
            values: dict[str, Any] = json.loads(path.read_text())
            episodes = [Episode(**episode) for episode in values.pop("episodes")]
            return cls(episodes=episodes, **values)
        except FileNotFoundError:
            raise DatasetError(
                f"{path} does not exist; `bench fuzz` writes a file for every failure"
            ) from None
        except (json.JSONDecodeError, KeyError, TypeError) as error:
            raise DatasetError(f"{path} is no failure of `bench fuzz` ({error})") from error


def play(case: FuzzCase) -> Failure | None:
    """Play a case; return what went wrong, if anything did."""
    env = _environment(case.soil, case.fidelity)
    rng = np.random.default_rng((case.seed, case.number))
    lengths = _episode_lengths(case.steps, rng)
    episodes: list[Episode] = []
    for length in lengths:
        scene_id = int(rng.integers(_SCENES))
        episodes.append(Episode(scene_id=scene_id, target_id=int(rng.integers(TARGETS_PER_SCENE))))
        problem = _play_episode(env, case, episodes[-1], length, rng)
        if problem:
            return Failure(
                case=str(case), problem=problem, soil=case.soil, fidelity=case.fidelity, episodes=episodes
            )
    return None


def replay(failure: Failure) -> str:
    """Do again what led to a failure; return the problem, or an empty string.

    The last episode alone is tried first: a reset is exact, so what was done before it should not matter.
    """
    return _replay(failure, failure.episodes[-1:]) or _replay(failure, failure.episodes)


def _replay(failure: Failure, episodes: list[Episode]) -> str:
    env = _environment(failure.soil, failure.fidelity)
    for episode in episodes:
        check, problem = _begin(env, episode)
        for action in episode.actions:
            problem = problem or _step(env, check, np.array(action, dtype=np.float32))
        if problem:
            return problem
    return ""


def _play_episode(
    env: ExcavatorEnv, case: FuzzCase, episode: Episode, length: int, rng: np.random.Generator
) -> str:
    check, problem = _begin(env, episode)
    actions = STYLES[case.style](env, rng)
    for _ in range(length):
        if problem:
            break
        action = next(actions)
        episode.actions.append(action.tolist())
        problem = _step(env, check, action)
    return problem


def _begin(env: ExcavatorEnv, episode: Episode) -> tuple[SoundnessCheck, str]:
    env.reset(options={"scene_id": episode.scene_id, "target_id": episode.target_id})
    return SoundnessCheck(env), reset_problem(env)


def _step(env: ExcavatorEnv, check: SoundnessCheck, action: Action) -> str:
    try:
        observation, reward, _, _, _ = env.step(action)
    except (ExcavError, ArithmeticError, ValueError, IndexError) as error:
        return f"{type(error).__name__}: {error}"
    return check.problem(observation["agent_pos"]) or ("" if np.isfinite(reward) else f"reward={reward}")


def _environment(soil: str, fidelity: str) -> ExcavatorEnv:
    return ExcavatorEnv(
        soil=soil, fidelity=fidelity, obs_type="agent_pos", render_mode=None, episode_length=ENDLESS_FRAMES
    )


def _episode_lengths(steps: int, rng: np.random.Generator) -> list[int]:
    """Divide the steps of a case: half of the cases are reset somewhere in the middle."""
    if steps < 2 or rng.uniform() > _SHARE_WITH_RESET:
        return [steps]
    first = int(rng.integers(1, steps))
    return [first, steps - first]
