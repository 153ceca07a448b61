"""Session logs that were changed at random, from which a recording is completed and recovered."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.datasets.complete import recovery

from ..datasets.complete.test_resimulation import make_recording
from ..datasets.toy import record_toy
from .mutation import GARBAGE, digests, harmful, harmless, inputs, overwritten, require_kept, require_right, run

pytestmark = pytest.mark.slow

LOG = "session.jsonl"
# What cannot stand in a line, by what the session log says of its events.
WRONG_FIELDS = {
    "session": {
        "env": ["no_such_env", None, 3],
        "simulation_version": [0, -1, 99, None, "1"],
        "settings": [None, [], {"fps": 0}, {"no_such": 1}, {"task": "Dance-v0"}],
    },
    "episode": {
        "episode_index": [-1, None, "0", 1.5, 7],
        "scene_id": [-1, None, "0", 2**40],
        "stage": [-1, 1, None, "0"],
        "target_id": [-1, 4, None, "0"],
    },
    "action": {
        "state": [None, [], [0.0], "x", [float("nan")] * 4],
        "action": [None, [], [0.0], "x", [float("inf"), 0.0]],
    },
    "ended": {"frames": [-1, 0, None, 1.5, 99]},
}


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    """One scene with four targets, as `lerobot-record` leaves it, and its log. Not to be changed by tests."""
    folder = tmp_path_factory.mktemp("sessions")
    record_toy(folder / "whole", scenes=1)
    return make_recording(folder / "whole", folder)


@st.composite
def changed_events(draw, log):
    """Draw a log of which one event was changed."""
    events = [json.loads(line) for line in log.read_text().splitlines()]
    kind = draw(st.sampled_from(["wrong", "missing", "unknown event", "unknown field", "drive", "frames", "discarded"]))
    name = draw(st.sampled_from(sorted(WRONG_FIELDS)))
    places = [number for number, event in enumerate(events) if event["event"] == name]
    place = places[draw(st.integers(0, len(places) - 1))]
    event = events[place]
    words = f"{kind} in line {place + 1}"
    if kind == "wrong":
        field = draw(st.sampled_from(sorted(WRONG_FIELDS[name])))
        event[field] = draw(st.sampled_from(WRONG_FIELDS[name][field]))
        words += f": {field}={event[field]!r}"
    elif kind == "missing":
        field = draw(st.sampled_from(sorted(event)))
        del event[field]
        words += f": {field}"
    elif kind == "unknown event":
        event["event"] = draw(st.sampled_from(["acton", "", None, 3]))
    elif kind == "unknown field":
        event[draw(st.sampled_from(["note", "frame"]))] = 1
    elif kind == "drive":
        actions = [event for event in events if event["event"] == "action"]
        changed = actions[draw(st.integers(0, len(actions) // 2))]
        changed["action"] = [value - 0.5 if value > 0.0 else value + 0.5 for value in changed["action"]]
    elif kind == "frames":
        actions = [number for number, event in enumerate(events) if event["event"] == "action"]
        number = draw(st.sampled_from(actions))
        if draw(st.booleans()):
            del events[number]
        else:
            events.insert(number, dict(events[number]))
        words = f"frame lost or doubled in line {number + 1}"
    else:
        ends = [number for number, event in enumerate(events) if event["event"] == "ended"]
        number = draw(st.sampled_from(ends[:-1]))
        events.insert(number + 1, {"event": "discarded"})
        words = f"discarded behind line {number + 1}"
    return harmful(words, lambda folder: write(folder, events))


@st.composite
def changed_lines(draw, log):
    """Draw a log that is damaged as text, or looks otherwise without being so."""
    lines = log.read_text().splitlines()
    kind = draw(st.sampled_from(["garbage", "cut in the middle", "not JSON", "blank", "no end", "connected once more"]))
    number = draw(st.integers(1, len(lines) - 2))
    if kind == "garbage":
        return overwritten(LOG, draw(GARBAGE))
    if kind == "cut in the middle":
        lines[number] = lines[number][:-2]
    elif kind == "not JSON":
        lines.insert(number, draw(st.sampled_from(["{", "3", "null", "[]", '"x"', "\0", "\ufffd"])))
    elif kind == "blank":
        lines.insert(number, "  ")
    elif kind == "connected once more":
        lines.append(lines[0])
    label = harmful if kind in ("cut in the middle", "not JSON") else harmless
    text = "\n".join(lines) + "\n" * (kind != "no end")
    return label(f"{kind} at line {number + 1}", lambda folder: (folder / LOG).write_text(text))


def write(folder, events):
    (folder / LOG).write_text("".join(json.dumps(event) + "\n" for event in events))


def judge(change, recorded, folder, option):
    """Complete a recording, or recover it, from a changed log."""
    recording, log = recorded
    (folder / LOG).write_bytes(log.read_bytes())
    change.apply(folder)
    before = digests(folder, recording)
    arguments = [f"--session={folder / LOG}", f"--out={folder / 'out'}", *option]
    outcome = run("index", recording, *arguments)
    require_right(change, outcome)
    require_kept(before, digests(folder, recording))
    assert outcome.code == 0 or not (folder / "out").exists(), "left half of a dataset"


@inputs(few=10)
@given(data=st.data(), option=st.sampled_from([[], ["--recover"]]))
def test_a_changed_session_log_is_refused_in_words_or_used(tmp_path_factory, recorded, data, option):
    change = data.draw(st.one_of(changed_events(recorded[1]), changed_lines(recorded[1])))
    judge(change, recorded, tmp_path_factory.mktemp("log"), option)


def test_a_recovery_that_believes_every_state_is_found_out(tmp_path, recorded, monkeypatch):
    monkeypatch.setattr(recovery, "STATE_TOLERANCE", float("inf"))
    events = [json.loads(line) for line in recorded[1].read_text().splitlines()]
    first = next(event for event in events if event["event"] == "action")
    first["action"] = [value - 0.5 if value > 0.0 else value + 0.5 for value in first["action"]]
    with pytest.raises(AssertionError, match="accepted in silence"):
        judge(harmful("another action", lambda folder: write(folder, events)), recorded, tmp_path, ["--recover"])


@pytest.mark.parametrize(
    ("fault", "found"),
    [
        (lambda log: {}["no such event"], KeyError),  # a traceback
        (lambda log: log.with_name("thesis.md").unlink(), AssertionError),  # a lost file
    ],
)
def test_a_recovery_that_breaks_or_removes_a_file_is_found_out(tmp_path, recorded, monkeypatch, fault, found):
    (tmp_path / "thesis.md").write_text("three years of work")
    read = recovery.read_session
    monkeypatch.setattr(recovery, "read_session", lambda log: (fault(log), read(log))[1])
    with pytest.raises(found, match=r"no such event|lost or changed: .*thesis\.md"):
        judge(harmless("nothing", lambda folder: None), recorded, tmp_path, ["--recover"])
