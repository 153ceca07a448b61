"""Metrics files that were changed at random, read by `lerobot-excav report`."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.evaluation import metrics

from ..evaluation.conftest import GRASP, SCOOP, line
from .mutation import GARBAGE, digests, harmful, harmless, inputs, overwritten, require_kept, require_right, run

NOT_FINITE = [float("nan"), float("inf"), float("-inf")]
# What a field cannot be, by what `docs/reference/metrics.md` says that it is.
WRONG = {
    "count": [None, True, 1.5, "1", [], {}, *NOT_FINITE, -1],
    "number": [None, True, "3.0", [], {}, *NOT_FINITE],
    "truth": [None, 0, 1, "true", [], 2.0],
    "word": [None, 3, True, [], {}],
}
FIELDS = {
    **dict.fromkeys(("simulation_version", "fps", "episode_length", "scene_id", "target_id"), "count"),
    **dict.fromkeys(("mask_noise_px", "frames", "mask_missing_frames"), "count"),
    **dict.fromkeys(("target_overlay", "is_success", "mask_missing"), "truth"),
    **dict.fromkeys(("task", "scene_set", "mask_source", "mask_condition", "mask_noise"), "word"),
}
OWN_FIELDS = {
    "Scoop-v0": {
        **dict.fromkeys(("soil", "fidelity"), "word"),
        **dict.fromkeys(("retained_mass_kg", "residual_bucket_mass_kg"), "number"),
        **dict.fromkeys(("hard_target_contacts", "spill_before_target_events"), "count"),
        "target_success": "truth",
    },
    "FR5Grasp-v0": {"episode_return": "number", "blocks_in_tray": "count", "target_in_tray": "truth"},
}
OUT_OF_RANGE = {
    "fps": [0],
    "episode_length": [0],
    "scene_set": ["", "tset", "TEST"],
    "stage": [-1, None, 1.0, "1"],
    "mask_condition": ["", "wrong"],
    "mask_dropout": [-0.1, 1.0, None, "0.2", float("nan")],
    "mask_iou": [-0.1, 1.1, "1", float("nan")],
    "mask_noise": ["blur"],
    "task": ["Dance-v0", ""],
    "shown_target_id": [-2, 4, None, 1.0, "1"],
    "first_grasped_block": [-2, 4, None, "1"],
    "commands": [[], None, 3, [[0]], [[0, 1, 2]], [[1, 0]], [["0", 0]], [[0, 0], [0, 1]], [[0, 9]], {}],
}


@st.composite
def changed_lines(draw):
    """Draw a file of 3 lines, of which one may be changed."""
    task = draw(st.sampled_from([SCOOP, GRASP]))
    lines = [line(task, number) for number in range(3)]
    entry = lines[draw(st.integers(0, 2))]
    kinds = {**FIELDS, **OWN_FIELDS[task["task"]]}
    change = draw(st.sampled_from(["type", "range", "missing", "unknown entry", "other order", "another value"]))
    if change == "type":
        name = draw(st.sampled_from(sorted(kinds)))
        entry[name] = draw(st.sampled_from(WRONG[kinds[name]]))
    elif change == "range":
        name = draw(st.sampled_from(sorted(OUT_OF_RANGE.keys() & entry.keys())))
        entry[name] = draw(st.sampled_from(OUT_OF_RANGE[name]))
    elif change == "missing":
        name = draw(st.sampled_from([*kinds, "commands", "shown_target_id"]))
        del entry[name]
    elif change == "unknown entry":
        name = draw(st.text(min_size=1).filter(lambda text: text not in entry and text != "operator"))
        entry[name] = draw(st.one_of(st.none(), st.integers(), st.text(), st.lists(st.integers(), max_size=3)))
    elif change == "other order":
        name = "entries"
        turned = dict(reversed(entry.items()))
        entry.clear()
        entry.update(turned)
    else:
        name = "retained_mass_kg" if task is SCOOP else "episode_return"
        entry[name] = draw(st.one_of(st.integers(0, 900), st.floats(0.0, 900.0)))
    label = harmful if change in ("type", "range", "missing") else harmless
    text = "".join(json.dumps(entry) + "\n" for entry in lines)
    return label(f"{change} of {name}: {entry.get(name)!r}", lambda folder: _write(folder, text.encode()))


@st.composite
def changed_bytes(draw):
    """Draw a file that is no metrics file any more, or one that only looks otherwise."""
    lines = [json.dumps(line(SCOOP, number)) for number in range(3)]
    number = draw(st.integers(0, 2))
    kind = draw(st.sampled_from(["garbage", "line cut", "garbage between", "twice", "list", "blank lines", "no end"]))
    if kind == "garbage":
        return overwritten("m.jsonl", draw(GARBAGE))
    if kind == "line cut":
        lines[number] = lines[number][: draw(st.integers(1, len(lines[number]) - 1))]
    elif kind == "garbage between":
        lines.insert(number, draw(st.sampled_from(["{", "null", "3", '"text"', "{}", "\ufffd", "\0"])))
    elif kind == "twice":
        lines.append(json.dumps({**line(SCOOP, number), "episode_ix": 3}))
    elif kind == "list":
        lines[number] = f"[{lines[number]}]"
    elif kind == "blank lines":
        lines.insert(number, "   ")
    text = "\n".join(lines) + ("" if kind == "no end" else "\n")
    label = harmless if kind in ("blank lines", "no end") else harmful
    return label(f"{kind} at line {number + 1}", lambda folder: _write(folder, text.encode()))


def _write(folder, data):
    (folder / "m.jsonl").write_bytes(data)


def judge(change, folder):
    """Report on a changed file, beside the files of somebody else."""
    change.apply(folder)
    (folder / "out").mkdir(exist_ok=True)
    (folder / "out" / "thesis.md").write_text("three years of work")
    before = digests(folder, own=("out/report.md", "out/report.json"))
    outcome = run("report", folder / "m.jsonl", f"--out={folder / 'out'}")
    require_right(change, outcome)
    require_kept(before, digests(folder))


@inputs(few=40)
@given(change=st.one_of(changed_lines(), changed_bytes()))
def test_a_changed_metrics_file_is_refused_in_words_or_taken(tmp_path_factory, change):
    judge(change, tmp_path_factory.mktemp("m"))


def test_a_reader_that_believes_everything_is_found_out(tmp_path, monkeypatch):
    monkeypatch.setattr(metrics, "validated", lambda model, text, place: model.model_construct(**json.loads(text)))
    text = json.dumps({**line(SCOOP, 0), "frames": -1})
    with pytest.raises(AssertionError, match="accepted in silence"):
        judge(harmful("negative frames", lambda folder: _write(folder, text.encode())), tmp_path)


def test_a_reader_that_breaks_is_found_out(tmp_path, monkeypatch):
    monkeypatch.setattr(metrics, "validated", lambda model, text, place: json.loads(text)["no such entry"])
    with pytest.raises(KeyError):
        judge(harmless("nothing", lambda folder: _write(folder, json.dumps(line(SCOOP, 0)).encode())), tmp_path)
