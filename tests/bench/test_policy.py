import pytest

from bench.policy import measure, take_turns


@pytest.mark.slow
def test_speed_is_printed_for_act_and_both_presets(capsys):
    measure(rounds=1, batch_size=2, height=32, width=48, chunk_size=8)
    lines = [line.rsplit(maxsplit=2 if "samples" in line else 4) for line in capsys.readouterr().out.splitlines()]
    policies = ["act", "mask_act paper", "mask_act fast"]
    assert [line[0].strip() for line in lines] == [
        f"{what} {name}" for name in policies for what in ("training", "planning")
    ]
    assert all(float(line[1]) > 0 for line in lines)


def test_tasks_take_turns_after_one_untimed_run():
    calls = []
    medians = take_turns({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, rounds=2)
    assert calls == ["a", "b"] * 3
    assert list(medians) == ["a", "b"]
