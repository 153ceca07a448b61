"""Demonstrations from several stages of a scene, on the example task with stages added to it: they change nothing."""

import dataclasses

import pytest
import toy_reach.env
from toy_reach.spec import REACH

from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.datasets.record import simulation
from lerobot_excav.datasets.record.provenance import read_provenance
from lerobot_excav.envs.tasks import registry
from lerobot_excav.envs.tasks.selection import TargetAbsentError
from lerobot_excav.errors import DatasetError

from ..toy import load, record_toy
from .test_demonstrations import contents

NEAREST = {"targets": 1, "target_rule": "nearest"}


def nearest_target(settings, scene_id, stage):
    """Name a target, and note that it was looked for."""
    LOOKED_FOR.append((scene_id, stage))
    return (scene_id + stage) % 4


LOOKED_FOR: list[tuple[int, int]] = []


@pytest.fixture(autouse=True)
def has_stages(monkeypatch):
    entry = f"{__name__}:nearest_target"
    spec = dataclasses.replace(REACH, last_stage=9, nearest_target_entry=entry)
    monkeypatch.setitem(registry.TASKS, REACH.id, spec)
    # An environment that another test left open plays the task without stages.
    monkeypatch.setattr(simulation, "_open", [])
    LOOKED_FOR.clear()


@pytest.fixture
def played(monkeypatch):
    """Note which pairs are played."""
    pairs, play = [], simulation.play_demonstration
    monkeypatch.setattr(simulation, "play_demonstration", lambda *a: (pairs.append(a[1]), play(*a))[1])
    return pairs


def offer(monkeypatch, targets_at):
    """Let the starts at some stages offer fewer targets."""
    start = toy_reach.env.ReachEnv._start

    def limited(env, selection):
        if selection.target_id >= targets_at.get(selection.stage, 4):
            raise TargetAbsentError("there is none")
        start(env, selection)

    monkeypatch.setattr(toy_reach.env.ReachEnv, "_start", limited)


def test_the_stage_is_in_every_frame_and_the_episodes_of_a_scene_stand_together(tmp_path):
    record_toy(tmp_path / "d", scenes=2, targets=2, stages="3,0")
    index = build_index(tmp_path / "d")
    assert index["pair_uid"].tolist() == [
        *(f"toy_reach/train/0/{start}" for start in ("0/0", "0/1", "3/1", "3/2")),
        *(f"toy_reach/train/1/{start}" for start in ("0/1", "0/2", "3/2", "3/3")),
    ]
    assert index["stage"].tolist() == [0, 0, 3, 3] * 2
    assert {int(item["excav.stage"]) for item in load(tmp_path / "d", [2, 3])} == {3}
    assert index["fingerprint"].is_unique


def test_targets_that_a_start_does_not_offer_are_skipped_and_said(tmp_path, monkeypatch):
    offer(monkeypatch, {4: 3, 9: 0})
    summary = record_toy(tmp_path / "d", scenes=1, stages="0,4,9")
    assert (summary.episodes, summary.failures) == (7, [])
    assert summary.absent == ["toy_reach/train/0/4/3", *(f"toy_reach/train/0/9/{target}" for target in range(4))]
    assert [outcome["kept"] for outcome in read_provenance(tmp_path / "d").outcomes] == [True] * 7 + [False] * 5
    assert record_toy(tmp_path / "d", scenes=1, stages="0,4,9", resume=True).absent == summary.absent
    with pytest.raises(DatasetError, match=r"none of the 4 targets asked for is offered .* earlier --stages"):
        record_toy(tmp_path / "e", scenes=1, stages="9")


@pytest.mark.slow
@pytest.mark.parametrize("rule", [{}, NEAREST], ids=["all", "nearest"])
def test_an_interrupted_run_reaches_nothing_twice_and_continues_to_the_same_bytes(tmp_path, monkeypatch, played, rule):
    settings = {"scenes": 2, "stages": "0,2,4", **rule}
    record_toy(tmp_path / "whole", **settings)
    number, looked_for = len(played), len(LOOKED_FOR)
    assert looked_for == (6 if rule else 0)
    play = simulation.play_demonstration

    def interrupted(*arguments):
        if len(played) == number + number // 2 + 1:
            raise KeyboardInterrupt
        return play(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(simulation, "play_demonstration", interrupted)
        with pytest.raises(KeyboardInterrupt):
            record_toy(tmp_path / "broken", **settings)
    record_toy(tmp_path / "broken", resume=True, **settings)
    assert played[number:] == played[:number]
    # Only the start at which the run was interrupted is looked at again.
    assert len(LOOKED_FOR) == (looked_for * 2 + 1 if rule else 0)
    assert contents(tmp_path / "broken") == contents(tmp_path / "whole")
    assert not (tmp_path / "broken.partial").exists()
