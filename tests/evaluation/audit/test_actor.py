"""Policies act in an audit as `lerobot-eval` lets them, planning as asked for."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lerobot_excav.envs.tasks.grasp.spec import GRASP
from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.audit.actor import PolicyActor, policy_config, policy_digest, require_same_machine
from lerobot_excav.evaluation.audit.audit import play_audit
from lerobot_excav.evaluation.audit.settings import AuditSettings, policy_variants

CHECKPOINT = Path(__file__).parents[3] / "checkpoints" / "fr5_grasp_mask_act"
FRAMES = 8


@pytest.fixture(scope="module")
def env():
    env = GRASP.make_env(render_mode=None)
    yield env
    env.close()


def actions(env, *overrides):
    """Return the first actions in a scene, (FRAMES, 7), and how many plans were made."""
    actor, plans = PolicyActor(CHECKPOINT, overrides), []
    plan = actor._policy.predict_action_chunk
    actor._policy.predict_action_chunk = lambda batch: (plans.append(1), plan(batch))[1]
    observation, _ = env.reset(seed=0)
    actor.begin(env)
    found = []
    for _ in range(FRAMES):
        found.append(actor.act(env, observation))
        observation, *_ = env.step(found[-1])
    return np.stack(found), len(plans)


@pytest.mark.slow
def test_a_policy_plans_as_its_checkpoint_says_or_as_asked_for(env):
    usual, plans = actions(env)
    assert plans == 1
    assert np.array_equal(actions(env)[0], usual)
    often, plans = actions(env, "--temporal_ensemble_coeff=null", "--n_action_steps=2")
    assert plans == FRAMES / 2
    assert not np.array_equal(often, usual)
    averaged, plans = actions(env, "--n_action_steps=1", "--temporal_ensemble_coeff=0.01")
    assert plans == FRAMES
    assert not np.array_equal(averaged, often)


def test_what_is_no_policy_is_named(tmp_path):
    with pytest.raises(ConfigurationError, match="holds no policy"):
        PolicyActor(tmp_path)


@pytest.mark.parametrize("override", ["--n_action_steps=1000", "--colour=red", "--n_action_steps=many"])
def test_a_setting_that_a_policy_cannot_have_is_an_error_of_ours(override):
    with pytest.raises(ConfigurationError):
        policy_config(CHECKPOINT, (override,))


@pytest.mark.parametrize(
    ("env_type", "settings", "words"),
    [
        ("excavator", {}, r"observation.state of shape \(7,\), and .*Scoop-v0 has \(8,\); give --env.type"),
        ("fr5_grasp", {"observation_height": 48}, r"\(3, 96, 128\), and .* has \(3, 48, 128\)"),
    ],
)
def test_a_policy_of_another_machine_or_picture_is_refused_before_all_else(tmp_path, env_type, settings, words):
    env = env_types()[env_type].settings.of({**settings, "scene_set": "test"})
    variants = policy_variants(CHECKPOINT, against=None, plans=(), ensemble=None)
    audit = AuditSettings(env=env, first_scene=0, scenes=1, stage=0, variants=variants, seed=0)
    with pytest.raises(ConfigurationError, match=words):
        play_audit(audit, tmp_path / "scenes", workers=0, show_progress=False)
    assert not (tmp_path / "scenes").exists()


CAMERAS = dict.fromkeys(("main", "cab", "target_mask"), (3, 96, 128))


def policy_of(cameras=CAMERAS, state=8, **settings):
    """Return the configuration of a policy of the excavator, as far as it is compared with a machine."""
    feature = lambda *shape: SimpleNamespace(shape=shape)  # noqa: E731
    inputs = {f"observation.images.{name}": feature(*shape) for name, shape in cameras.items()}
    inputs["observation.state"] = feature(state)
    outputs = {"action": feature(4)}
    return SimpleNamespace(pretrained_path="policy", input_features=inputs, output_features=outputs, **settings)


@pytest.mark.parametrize(
    "config",
    [
        policy_of(),
        policy_of(cameras={**CAMERAS, "empty_camera_0": (3, 480, 640)}),
        policy_of(cameras={**CAMERAS, "cab": (3, 48, 64)}, resize_imgs_with_padding=(512, 512)),
        SimpleNamespace(pretrained_path="policy", input_features=None, output_features=None),
    ],
    ids=["as it is", "a camera that the policy fills itself", "pictures that the policy resizes", "nothing declared"],
)
def test_a_policy_that_can_work_on_a_machine_is_let_through(config):
    require_same_machine(config, env_types()["excavator"].settings.of({}))


@pytest.mark.parametrize(
    ("config", "words"),
    [
        (
            policy_of(cameras={**CAMERAS, "wrist": (3, 96, 128)}, resize_imgs_with_padding=(512, 512)),
            "wrist .* has none",
        ),
        (
            policy_of(cameras={**CAMERAS, "cab": (1, 96, 128)}, resize_imgs_with_padding=(512, 512)),
            r"cab of shape \(1, 96",
        ),
        (policy_of(cameras={**CAMERAS, "cab": (3, 48, 64)}, resize_to=(96, 128)), r"cab of shape \(3, 48, 64\)"),
        (policy_of(state=7, resize_imgs_with_padding=(512, 512)), r"state of shape \(7,\)"),
    ],
)
def test_a_policy_that_cannot_work_on_a_machine_is_refused_though_it_resizes_pictures(config, words):
    with pytest.raises(ConfigurationError, match=words):
        require_same_machine(config, env_types()["excavator"].settings.of({}))


def test_a_digest_tells_policies_apart(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "config.json").write_text("{}")
        (tmp_path / name / "model.safetensors").write_bytes(b"1")
    assert policy_digest(tmp_path / "a") == policy_digest(tmp_path / "b")
    (tmp_path / "b" / "model.safetensors").write_bytes(b"2")
    assert policy_digest(tmp_path / "a") != policy_digest(tmp_path / "b")
