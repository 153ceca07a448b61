"""mask_act through `lerobot-train` in several processes, as accelerate starts them on a cluster."""

import subprocess
import sys

import pytest
import torch
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.policies.factory import make_pre_post_processors
from torch.utils.data import DataLoader

from lerobot_excav.policies.mask_act.modeling_mask_act import MaskACTPolicy

pytestmark = pytest.mark.slow

STEPS = 4
# One action a plan: two halves of a batch then hold equally many actions inside their episodes.
SHARED = (
    *("--policy.type=mask_act", "--policy.preset=fast", "--policy.chunk_size=1", "--policy.n_action_steps=1"),
    *("--policy.actions_per_token=1", "--policy.dim_model=32", "--policy.dropout=0", "--policy.device=cpu"),
    *("--policy.push_to_hub=false", "--dataset.repo_id=tests/tiny", "--num_workers=0", "--env_eval_freq=0"),
    *("--wandb.enable=false", f"--steps={STEPS}", "--save_freq=1", "--seed=5"),
)


def trained(dataset, out, *, processes, batch_size, norm):
    """Train with so many processes; return the checkpoints, step by step."""
    launch = ["-m", "torch.distributed.run", "--standalone", f"--nproc_per_node={processes}"]
    train = ["-m", "lerobot.scripts.lerobot_train", *SHARED, f"--policy.backbone_norm={norm}"]
    paths = [f"--dataset.root={dataset}", f"--output_dir={out}", f"--batch_size={batch_size}"]
    command = [sys.executable, *launch, *train, *paths]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert f"Effective batch size: {batch_size} x {processes} = {batch_size * processes}" in done.stdout + done.stderr
    return [path / "pretrained_model" for path in sorted((out / "checkpoints").iterdir()) if not path.is_symlink()]


@torch.no_grad()
def loss_of(checkpoint, dataset):
    """Return the loss over the whole dataset, as one batch."""
    policy = MaskACTPolicy.from_pretrained(checkpoint)
    preprocess, _ = make_pre_post_processors(policy.config, pretrained_path=str(checkpoint))
    items = LeRobotDataset("tests/tiny", root=dataset, delta_timestamps={"action": [0.0]})
    policy.eval()
    return policy.forward(preprocess(next(iter(DataLoader(items, batch_size=len(items))))))[0].item()


@pytest.fixture(scope="module")
def losses(dataset, tmp_path_factory):
    """Losses after every step: of two processes, and of one with twice the batch."""

    def measured(norm):
        out = tmp_path_factory.mktemp(norm)
        two = trained(dataset, out / "two", processes=2, batch_size=2, norm=norm)
        one = trained(dataset, out / "one", processes=1, batch_size=4, norm=norm)
        assert len(two) == len(one) == STEPS
        return [[loss_of(checkpoint, dataset) for checkpoint in run] for run in (two, one)]

    return measured


def test_two_processes_learn_what_one_learns_from_twice_the_batch(losses):
    two, one = losses("frozen")
    assert len(set(one)) == STEPS  # something is learned at every step
    assert two == pytest.approx(one, rel=0.0, abs=1e-5)


def test_batch_normalisation_sees_each_half_by_itself(losses):
    two, one = losses("batch")
    assert two != pytest.approx(one, rel=0.0, abs=1e-5)
    assert two == pytest.approx(one, rel=0.2)  # but little depends on it
