import pytest
import torch

from lerobot_excav.policies.mask_act.benchmark import measure_policies, take_turns

pytestmark = pytest.mark.slow


def test_speed_is_measured_for_act_and_both_presets():
    threads = torch.get_num_threads()
    speeds = measure_policies(batch_size=2, rounds=1, height=32, width=48, chunk_size=8, threads=1)
    assert [speed.name for speed in speeds] == ["act", "mask_act paper", "mask_act fast"]
    assert torch.get_num_threads() == threads
    parameters = {speed.name: speed.parameter_count for speed in speeds}
    assert parameters["mask_act fast"] * 10 < parameters["act"]
    for speed in speeds:
        assert speed.training_samples_per_s > 0
        assert speed.inference_ms > 0


def test_tasks_take_turns_after_one_untimed_run():
    calls = []
    durations = take_turns({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, rounds=2)
    assert calls == ["a", "b"] * 3
    assert {name: len(times) for name, times in durations.items()} == {"a": 2, "b": 2}
