"""Plans end where the command changes."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.policies.mask_act.command_changes import COMMAND_KEY, CommandChanges, frames_under_command


def frames_left_one_by_one(episodes):
    """Count, for every frame, the frames until the command differs, in the slow and obvious way."""
    left = []
    for commands in episodes:
        for i, now in enumerate(commands):
            changes = [j for j in range(i, len(commands)) if commands[j] != now]
            left.append(changes[0] - i if changes else 0)
    return left


@given(st.lists(st.lists(st.integers(0, 3), min_size=1, max_size=9).map(sorted), min_size=1, max_size=5))
def test_frames_are_counted_as_one_by_one(episodes):
    number = np.concatenate([np.full(len(commands), i) for i, commands in enumerate(episodes)])
    assert frames_under_command(number, np.concatenate(episodes)).tolist() == frames_left_one_by_one(episodes)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Four episodes of the example task, each with a change of mind."""
    out = tmp_path_factory.mktemp("changed") / "data"
    env = {"observation_height": 32, "observation_width": 48}
    settings = DemonstrationSettings.of("toy_reach", env, scenes=1, retarget=1.0)
    record_demonstrations(settings, out, workers=0, show_progress=False)
    return out


def described(root, **changes):
    frames = pd.concat(pd.read_parquet(path) for path in sorted((root / "data").rglob("*.parquet")))
    values = {"root": root, "features": {COMMAND_KEY: {}}, "total_frames": len(frames), **changes}
    return SimpleNamespace(**values), frames.sort_values("index", ignore_index=True)


def test_of_a_recorded_dataset_no_action_after_the_change_is_learnt(dataset):
    meta, frames = described(dataset)
    chunk = 12
    batch = {"index": torch.arange(len(frames)), "action_is_pad": torch.zeros(len(frames), chunk, dtype=torch.bool)}
    is_pad = CommandChanges(meta).is_pad(batch).numpy()
    assert is_pad.any()
    assert not batch["action_is_pad"].any()  # the batch stays as it is
    for i, row in frames.iterrows():
        for ahead in range(chunk):
            there = frames.iloc[i + ahead] if i + ahead < len(frames) else None
            is_later = there is not None and there["episode_index"] == row["episode_index"]
            is_later = is_later and there["excav.target_id"] != row["excav.target_id"]
            if there is not None and there["episode_index"] == row["episode_index"]:
                assert is_pad[i, ahead] == is_later, (i, ahead)


def test_without_the_column_or_without_changes_padding_is_as_lerobot_says(dataset):
    is_pad = torch.rand(3, 5) < 0.5
    assert CommandChanges(None).is_pad({"action_is_pad": is_pad}) is is_pad
    meta, _ = described(dataset, features={})
    assert CommandChanges(meta).is_pad({"action_is_pad": is_pad}) is is_pad


def test_a_dataset_that_is_elsewhere_is_warned_of(dataset, tmp_path, caplog):
    meta, _ = described(dataset)
    meta.root = tmp_path
    is_pad = torch.zeros(2, 5, dtype=torch.bool)
    assert CommandChanges(meta).is_pad({"action_is_pad": is_pad}) is is_pad
    assert "nothing says where commands change" in caplog.text


def test_batches_that_do_not_say_their_frames_and_damaged_datasets_are_refused(dataset):
    meta, _ = described(dataset)
    with pytest.raises(ConfigurationError, match="keep index in the batches"):
        CommandChanges(meta).is_pad({"action_is_pad": torch.zeros(3, 5, dtype=torch.bool)})
    meta, _ = described(dataset, total_frames=3)
    with pytest.raises(DatasetError, match=r"info\.json says that there are 3"):
        CommandChanges(meta)


def test_the_loss_leaves_later_commands_out(policy, batch, dataset):
    agent, data = policy(dropout=0.0).train(), batch(actions=True)
    size, chunk = data["action_is_pad"].shape
    data["action_is_pad"][:] = False
    agent._command_changes._frames_left = torch.full((size,), 1, dtype=torch.int32)
    first = agent.forward(data | {"index": torch.arange(size)})[0]
    changed = {**data, "index": torch.arange(size), "action": data["action"].clone()}
    changed["action"][:, 1:] += 100.0
    assert torch.equal(agent.forward(changed)[0], first)
    assert agent.eval().forward(changed)[0] > first + 10.0  # a validation set has frames of the same numbers
    agent.train()._command_changes._frames_left[:] = chunk
    assert agent.forward(changed)[0] > first + 10.0
