"""Paired demonstrations, recorded on the page, checked, and trained on."""

import subprocess
import sys

import pandas as pd
import pytest
from playwright.sync_api import expect

from lerobot_excav.datasets.check.quality_check import check_dataset

from .conftest import serving
from .driving import hold, state_of, until

TRAIN = (
    *("--policy.type=mask_act", "--policy.preset=fast", "--policy.n_encoder_layers=1", "--policy.chunk_size=2"),
    *("--policy.n_action_steps=1", "--policy.actions_per_token=1", "--policy.device=cpu", "--policy.push_to_hub=false"),
    *("--batch_size=2", "--steps=20", "--num_workers=0", "--log_freq=10", "--save_checkpoint=false"),
)


def record_episode(page, served):
    page.keyboard.press("KeyR")
    until(lambda: state_of(served)["recording"]["running"])
    hold(page, served, "ArrowLeft", until=lambda: state_of(served)["recording"]["frames"] >= 5)
    page.keyboard.press("KeyF")
    expect(page.locator("#judged")).to_be_visible()
    page.keyboard.press("KeyK")
    expect(page.locator("#judged")).to_be_hidden()


@pytest.mark.parametrize("scenes", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_four_paired_episodes_a_scene_are_recorded_pass_qc_and_are_trained_on(open_page, patience, tmp_path, scenes):
    out, episodes = tmp_path / "by_hand", 4 * scenes
    with serving(out=out, scenes=scenes) as served:
        page = open_page(served)
        expect(page.locator("#driver")).to_have_text("you have the controls")
        for number in range(episodes):
            expect(page.locator("#next")).to_contain_text(f"{episodes - number} of {episodes} left, {number} kept")
            record_episode(page, served)
        page.get_by_role("button", name="Write the dataset").click()
        expect(page.locator("#next")).to_contain_text("written", timeout=120_000)
    report = check_dataset(out, replays=episodes)
    assert report.has_passed, report
    index = pd.read_parquet(out / "meta" / "excav_pairs.parquet")
    assert sorted(index["pair_uid"]) == [f"excavator/train/{s}/0/{t}" for s in range(scenes) for t in range(4)]
    data = [f"--dataset.repo_id=local/{out.name}", f"--dataset.root={out}", f"--output_dir={tmp_path / 'train'}"]
    trained = subprocess.run(
        [sys.executable, "-m", "lerobot.scripts.lerobot_train", *data, *TRAIN],
        capture_output=True, text=True, encoding="utf-8", check=False,
    )  # fmt: skip
    assert trained.returncode == 0, trained.stderr[-2000:]
