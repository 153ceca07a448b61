"""Who acts in an audit: a policy from a checkpoint, or the scripted operator."""

import hashlib
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.datasets.format import schema
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv
from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.errors import ConfigurationError, require

# What policies of LeRobot call the size to which they bring all pictures. That of this package takes its own size only.
_RESIZING = ("resize_imgs_with_padding", "image_resolution", "resize_shape", "image_resize_shape")
_FILLED = schema.camera_key("empty_camera_")


class Actor(Protocol):
    """Whoever commands the machine."""

    def begin(self, env: MaskedTaskEnv[Any, Any]) -> None:
        """Start from the present state, without a memory of what was before."""

    def act(self, env: MaskedTaskEnv[Any, Any], observation: dict[str, Any]) -> NDArray[np.float32]:
        """Return the next action, (actions,)."""


class OperatorActor:
    """The scripted operator of a task, who works in the same manner after every `begin`.

    Args:
        seed: Seed of that manner.
    """

    def __init__(self, *seed: int) -> None:
        self._seed = seed

    def begin(self, env: MaskedTaskEnv[Any, Any]) -> None:
        """Let it look at the scene."""
        self._operator = env.task_spec.make_operator(np.random.default_rng(self._seed))
        self._operator.reset(env)

    def act(self, env: MaskedTaskEnv[Any, Any], observation: dict[str, Any]) -> NDArray[np.float32]:
        """Return its next action, (actions,)."""
        return np.asarray(self._operator.act(env), np.float32)


class PolicyActor:
    """A trained policy, loaded and called as `lerobot-eval` does it.

    Args:
        checkpoint: A `pretrained_model` folder.
        overrides: Settings of the policy that differ from the checkpoint's, such as `("--n_action_steps=3",)`.

    Raises:
        ConfigurationError: The folder holds no policy, or a setting is not possible.
    """

    def __init__(self, checkpoint: Path, overrides: tuple[str, ...] = ()) -> None:
        import torch
        from lerobot.policies.factory import get_policy_class, make_pre_post_processors

        self._torch, config = torch, policy_config(checkpoint, overrides)
        self._policy = get_policy_class(config.type).from_pretrained(checkpoint, config=config)
        self._policy.eval()
        device = {"device_processor": {"device": str(config.device)}}
        self._before, self._after = make_pre_post_processors(
            config, pretrained_path=str(checkpoint), preprocessor_overrides=device
        )

    def begin(self, env: MaskedTaskEnv[Any, Any]) -> None:
        """Forget plans and targets; a policy that samples draws the same numbers again."""
        self._policy.reset()
        self._torch.manual_seed(0)

    def act(self, env: MaskedTaskEnv[Any, Any], observation: dict[str, Any]) -> NDArray[np.float32]:
        """Return its next action, (actions,)."""
        from lerobot.envs.utils import preprocess_observation

        batch = preprocess_observation(observation) | {"task": [env.task_description]}
        with self._torch.inference_mode():
            action = self._after(self._policy.select_action(self._before(batch)))
        return np.asarray(action[0].numpy(), np.float32)


def policy_config(checkpoint: Path, overrides: tuple[str, ...] = ()) -> Any:
    """Return the configuration of a policy, some of whose settings differ from the checkpoint's.

    Raises:
        ConfigurationError: The folder holds no policy, or a setting is not possible.
    """
    from draccus.utils import DraccusException
    from lerobot.configs import PreTrainedConfig
    from lerobot.utils.import_utils import register_third_party_plugins

    register_third_party_plugins()
    if not (checkpoint / "config.json").is_file():
        raise ConfigurationError(
            f"{checkpoint} holds no policy (config.json is missing); give the pretrained_model folder of a run of "
            "lerobot-train, or a folder that lerobot-excav export has written"
        )
    try:
        config = PreTrainedConfig.from_pretrained(checkpoint, cli_overrides=list(overrides))
    except ConfigurationError:
        raise
    # LeRobot's parser ends the program at an option that a policy does not have.
    except (DraccusException, ValueError, TypeError, SystemExit) as error:
        wanted = f" with {' '.join(overrides)}" if overrides else ""
        raise ConfigurationError(f"{checkpoint} cannot be used{wanted}: {' '.join(str(error).split())}") from error
    config.pretrained_path = checkpoint
    return config


def require_same_machine(config: Any, settings: TaskSettings) -> None:
    """Check that a policy reads and commands what a machine has, before its numbers meet in the middle of an episode.

    Pictures of another size are left to a policy of LeRobot that resizes them. Some declare cameras that they fill
    themselves (`empty_cameras`).

    Args:
        config: Configuration of the policy.
        settings: Those of the environment.

    Raises:
        ConfigurationError: The policy was trained for another machine, or for pictures of another size.
    """
    spec, (height, width) = task_of_settings(settings), settings.observation_size
    sizes: dict[str, tuple[int, ...]] = {
        schema.STATE_KEY: (len(spec.state_names),),
        schema.ACTION_KEY: (len(spec.action_names),),
    }
    sizes |= {schema.camera_key(camera): (3, height, width) for camera in spec.cameras}
    resizes = any(getattr(config, name, None) for name in _RESIZING)
    for key, feature in {**(config.input_features or {}), **(config.output_features or {})}.items():
        if key.startswith(_FILLED):
            continue
        shape, there = tuple(feature.shape), sizes.get(key, ())
        is_free = resizes and key.startswith(schema.camera_key("")) and shape[:1] == there[:1]
        require(
            is_free or shape == there,
            f"{config.pretrained_path} was trained with {key} of shape {shape}, and {spec.id} has {there or 'none'}; "
            "give --env.type of its machine, or its --env.observation_height and _width",
        )


def policy_digest(checkpoint: Path) -> str:
    """Return a digest (SHA-256) of the files of a policy; folders such as `last` may hold another one tomorrow."""
    digest = hashlib.sha256()
    for path in sorted(checkpoint.glob("*.json")) + sorted(checkpoint.glob("*.safetensors")):
        digest.update(path.name.encode())
        with path.open("rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()
