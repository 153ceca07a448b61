"""What is read of a session log, and how a wrong line is named."""

import json

import numpy as np
import pytest
from toy_reach.spec import REACH

from lerobot_excav.datasets.complete.session import read_session
from lerobot_excav.errors import DatasetError

from ..toy import toy_settings

SESSION = {
    "event": "session",
    "simulation_version": REACH.simulation_version,
    "env": "toy_reach",
    "settings": toy_settings().env.as_dict(),
    "task": None,
}
EPISODE = {"event": "episode", "episode_index": 0, "scene_id": 0, "stage": 0, "target_id": 0}
OPERATOR = {"event": "operator", "operator": "scripted"}
ACTION = {"event": "action", "state": [0.5, 0.5], "action": [0.25, 0.0]}
COMMAND = {"event": "command", "target_id": 1}
RESTART = {"event": "restart", "scene_id": 0, "stage": 0, "target_id": 0, "state": None, "action": None}


@pytest.fixture
def read(tmp_path):
    """Write lines, events or texts, and read them."""

    def _read(*lines, end="\n"):
        texts = [line if isinstance(line, str) else json.dumps(line) for line in lines]
        path = tmp_path / "s.jsonl"
        path.write_text("\n".join(texts) + end)
        return read_session(path)

    return _read


def test_every_float32_comes_back_bit_for_bit(read, rng):
    bits = rng.integers(0, 2**32, 4000, dtype=np.uint64).astype(np.uint32).view(np.float32)
    values = bits[np.isfinite(bits)].reshape(-1)[:2000].reshape(-1, 2)
    frames = read(SESSION, EPISODE, *({**ACTION, "action": pair.tolist()} for pair in values))[0].runs[0].frames
    found = np.array([frame.action for frame in frames], np.float32)
    assert np.array_equal(found.view(np.uint32), values.view(np.uint32))


def test_who_drives_is_known_where_the_log_says_so_and_belongs_to_its_episode(read):
    second = {**EPISODE, "episode_index": 1}
    end = {"event": "ended", "frames": 1}
    episodes = read(SESSION, EPISODE, OPERATOR, ACTION, end, second, ACTION)
    assert [episode.operator for episode in episodes.values()] == ["scripted", None]


def test_a_restart_begins_another_run_with_its_own_commands(read):
    frame = {"state": [0.5, 0.5], "action": [0.25, 0.0]}
    restart = {**RESTART, "target_id": 2, **frame}
    (episode,) = read(SESSION, EPISODE, ACTION, ACTION, COMMAND, ACTION, restart, ACTION, COMMAND, ACTION).values()
    assert [(run.target_id, len(run.frames), run.schedule) for run in episode.runs] == [
        (0, 4, ((2, 1),)),
        (2, 2, ((1, 1),)),
    ]
    assert (episode.frames, episode.restarts) == (5, [3])


@pytest.mark.parametrize(
    ("line", "changes", "message"),
    [
        (2, {"episode_index": -1}, "episode_index=-1: .*greater than or equal to 0"),
        (2, {"scene_id": -3}, "scene_id=-3: .*greater than or equal to 0"),
        (2, {"target_id": 9}, "target_id=9 .*from 0 to 3"),
        (2, {"stage": 1}, "stage=1 .*from 0 to 0"),
        (2, {"stage": -1}, "stage=-1: .*greater than or equal to 0"),
        (2, {"target_id": True}, "target_id=True: .*valid integer"),
        (2, {"colour": 1}, "colour is not known"),
        (1, {"simulation_version": "1"}, "simulation_version='1': .*valid integer"),
        (1, {"env": "lathe"}, "env='lathe' .*'toy_reach'"),
        (1, {"settings": {**SESSION["settings"], "fps": "10"}}, "fps='10' .*give one of"),
        (1, {"settings": {**SESSION["settings"], "task": "Dance-v0"}}, "task='Dance-v0' .*'Reach-v0'"),
        (1, {"settings": {**SESSION["settings"], "colour": 1}}, "colour is not a setting of toy_reach; allowed: task"),
        (3, {"action": [0.25]}, r"action=\[0\.25\] has 1 values; toy_reach has 2"),
        (3, {"state": [0.5, 0.5, 0.5]}, r"state=.* has 3 values; toy_reach has 2"),
        (3, {"action": [0.1, 0.0]}, r"action\.0=0\.1: .*not a float32"),
        (3, {"action": [1e39, 0.0]}, r"action\.0=1e\+39: "),
        (3, {"action": [float("nan"), 0.0]}, r"action\.0=nan: .*finite"),
        (3, {"action": ["0.25", 0.0]}, r"action\.0='0\.25': .*valid number"),
        (3, {"event": "dance"}, "event='dance' is not known"),
        (3, {"event": "ended", "frames": 1}, "state is not known"),
    ],
)
def test_an_impossible_value_is_named_with_line_field_and_what_is_allowed(read, line, changes, message):
    lines = [SESSION, EPISODE, ACTION]
    lines[line - 1] = lines[line - 1] | changes
    with pytest.raises(DatasetError, match=rf"s\.jsonl:{line}: {message}"):
        read(*lines)


@pytest.mark.parametrize(
    ("lines", "place", "message"),
    [
        ([EPISODE], 1, "an episode begins before the line of its session"),
        ([SESSION, ACTION], 2, "event='action' comes before the line of its episode"),
        ([SESSION, {"event": "discarded"}], 2, "event='discarded' comes before"),
        ([SESSION, EPISODE, {"event": "ended", "frames": 0}, ACTION], 4, "event='action' comes after its episode has"),
        ([SESSION, EPISODE, ACTION, ACTION, {"event": "ended", "frames": 1}], 5, "frames=1, but the log has 2 frames"),
        ([SESSION, EPISODE, ACTION, {"event": "stopped", "frames": 2}], 4, "frames=2, but the log has 1 frames"),
        ([SESSION, EPISODE, COMMAND], 3, "commands: frame=0 .*from 1"),
        ([SESSION, EPISODE, ACTION, COMMAND, COMMAND], 5, "commands: frame=1 .*from 2"),
        ([SESSION, EPISODE, ACTION, {**COMMAND, "target_id": 7}], 4, "commands: target_id=7 .*from 0 to 3"),
        ([SESSION, EPISODE, {**OPERATOR, "operator": "dog"}], 3, "operator='dog'.*allowed: scripted, person, policy"),
        ([SESSION, OPERATOR], 2, "event='operator' comes before the line of its episode"),
        ([SESSION, EPISODE, ACTION, {**RESTART, "stage": 7}], 4, "stage=7 .*from 0 to 0"),
        ([SESSION, EPISODE, ACTION, {**RESTART, "target_id": 7}], 4, "target_id=7 .*from 0 to 3"),
        ([SESSION, "{", EPISODE], 2, "not JSON .* not the last line"),
        ([SESSION, EPISODE, "{"], 3, "not JSON .* not the last line"),
        (["", "[3]"], 2, "a JSON object is expected"),
        ([{"episode_index": 0, "frames": 3}], 1, "lacks event .*version 0.2.0"),
    ],
)
def test_a_line_out_of_turn_or_damaged_is_named(read, lines, place, message):
    with pytest.raises(DatasetError, match=rf"s\.jsonl:{place}: {message}"):
        read(*lines)


def test_a_line_that_was_cut_off_is_left_out_at_the_end_and_before_the_next_session(read):
    assert read(SESSION, EPISODE, ACTION, '{"event": "act', end="")[0].frames == 1
    assert read(SESSION, EPISODE, ACTION, '{"event": "act', SESSION, EPISODE, ACTION, ACTION)[0].frames == 2


def test_a_missing_session_is_named(tmp_path):
    with pytest.raises(DatasetError, match=r"none does not exist; .* --robot\.session_log"):
        read_session(tmp_path / "none")
