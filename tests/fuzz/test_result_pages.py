"""What a result page is made of, changed at random: its TOML file, and where its evaluations come from."""

import copy
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.evaluation.result_page import page_files

from ..evaluation.conftest import GRASP, line
from .mutation import GARBAGE, digests, harmful, harmless, inputs, overwritten, require_kept, require_right, run

pytestmark = pytest.mark.slow

ROWS = {
    "title": "Does it obey?",
    "metrics": "METRICS",
    "videos": "METRICS",
    "section": [
        {
            "title": "A table",
            "text": "About it.",
            "reference": "paired",
            "rows": [
                {"label": "paired", "about": "paired", "paper": {"success": 96.0}},
                {"label": "zero", "about": "no mask"},
                {"label": "later", "about": "not run"},
            ],
        }
    ],
    "curve": [{"label": "paired policy", "folder": "METRICS/curves/paired"}],
    "clips": [{"label": "paired", "episodes": [0]}],
}
ORIGIN = {
    "command": "lerobot-eval --policy.path=x",
    "commit": "0123456789abcdef",
    "modified": False,
    "packages": {"lerobot": "0.6.1"},
    "policy": "gone/pretrained_model",
}
TABLES = [(), ("section", 0), ("section", 0, "rows", 1), ("section", 0, "rows", 0), ("curve", 0), ("clips", 0)]
REQUIRED = [
    *(((), name) for name in ("title", "metrics")),
    (("section", 0), "title"),
    *((("section", 0, "rows", 1), name) for name in ("label", "about")),
    *((("curve", 0), name) for name in ("label", "folder")),
    *((("clips", 0), name) for name in ("label", "episodes")),
]
NO_TEXT = [3, True, 1.5, ["a"], {"a": 1}]
WRONG = {
    "words": NO_TEXT,
    "a row that is none": ["other", ""],
    "paper": [{"success": "96"}, {"success": True}, {"success": float("nan")}, {"no such figure": 1.0}, 96.0, "96"],
    "episodes": [[0.5], ["0"], [-1], 0, "0", [True]],
    "rows": ["paired", {}, [3], [{}]],
}


def at(tree, place):
    for part in place:
        tree = tree[part]
    return tree


@st.composite
def changed_rows(draw):
    """Draw the TOML file of a page with one change."""
    rows = copy.deepcopy(ROWS)
    kind = draw(st.sampled_from(["missing", "unknown", "wrong", "twice", "words", "figure", "no clips", "not TOML"]))
    if kind == "missing":
        place, name = draw(st.sampled_from(REQUIRED))
        del at(rows, place)[name]
        words = f"{place} lacks {name}"
    elif kind == "unknown":
        place, name = draw(st.sampled_from(TABLES)), draw(st.sampled_from(["labl", "x", "paper2", "sections"]))
        at(rows, place)[name] = draw(st.sampled_from([1, "x", [], {}]))
        words = f"{place} has {name}"
    elif kind == "wrong":
        words = draw(wrong_values(rows))
    elif kind == "twice":
        place = draw(st.sampled_from(["rows", "curve"]))
        table = rows["section"][0]["rows"] if place == "rows" else rows["curve"]
        table.append(copy.deepcopy(table[0]))
        words = f"the first of {place} stands there twice"
    elif kind == "words":
        place, name = draw(
            st.sampled_from([((), "title"), (("section", 0), "text"), (("section", 0, "rows", 0), "about")])
        )
        letters = st.characters(exclude_categories=["Cs", "Cc"])
        at(rows, place)[name] = words = draw(st.text(letters, min_size=1, max_size=40))
    elif kind == "figure":
        rows["section"][0]["rows"][0]["paper"]["success"] = words = draw(st.floats(0.0, 100.0))
    else:
        words = kind
        if kind == "no clips":
            del rows["clips"]
    label = harmless if kind in ("words", "figure", "no clips") else harmful
    text = "title = 'x\n[[" if kind == "not TOML" else toml(rows)
    return label(f"{kind}: {words}", lambda folder: write_rows(folder, text))


@st.composite
def wrong_values(draw, rows):
    """Put a value of another kind into the contents of a page; returns what it was, in words."""
    kind = draw(st.sampled_from(sorted(WRONG)))
    value = draw(st.sampled_from(WRONG[kind]))
    place, name = {
        "words": draw(st.sampled_from(REQUIRED[:-1])),
        "a row that is none": draw(st.sampled_from([(("section", 0), "reference"), (("clips", 0), "label")])),
        "paper": (("section", 0, "rows", 0), "paper"),
        "episodes": (("clips", 0), "episodes"),
        "rows": (("section", 0), "rows"),
    }[kind]
    at(rows, place)[name] = value
    return f"{place} {name}={value!r}"


@st.composite
def changed_origins(draw):
    """Draw a record of where an evaluation comes from, with one change."""
    origin = dict(ORIGIN)
    kind = draw(st.sampled_from(["garbage", "wrong", "missing", "absent", "unknown"]))
    name = "metrics/paired.json"
    if kind == "garbage":
        return overwritten(name, draw(GARBAGE))
    if kind == "absent":
        return harmless("no record", lambda folder: (folder / name).unlink())
    if kind == "wrong":
        field = draw(st.sampled_from(sorted(origin)))
        origin[field] = draw(st.sampled_from([3.5, ["a"], {"a": 1}]))
    elif kind == "missing":
        field = draw(st.sampled_from(["commit", "modified", "packages", "policy"]))
        del origin[field]
    else:
        field = draw(st.sampled_from(["host", "note"]))
        origin[field] = 1
    text = json.dumps(origin)
    label = harmful if kind == "wrong" else harmless
    return label(f"{kind}: {field}={origin.get(field)!r}", lambda folder: (folder / name).write_text(text))


@st.composite
def changed_videos(draw):
    """Draw a page with a video that cannot be played, or one of an episode that was not."""
    number = draw(st.sampled_from([0, 3, 9]))
    data = draw(GARBAGE)

    def apply(folder):
        videos = folder / "metrics" / "paired" / "videos" / "x"
        videos.mkdir(parents=True)
        (videos / f"eval_episode_{number}.mp4").write_bytes(data)
        rows = copy.deepcopy(ROWS)
        rows["clips"][0]["episodes"] = [number]
        write_rows(folder, toml(rows))

    return harmful(f"video {number} holds {data[:20]!r}", apply)


def toml(rows):
    """Write tables as TOML."""
    return "".join(f"{name} = {inline(value)}\n" for name, value in rows.items())


def inline(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(name)} = {inline(part)}" for name, part in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(inline, value)) + "]"
    if isinstance(value, float):
        return str(value)
    return json.dumps(value, ensure_ascii=False)


def write_rows(folder, text):
    (folder / "rows.toml").write_text(text.replace("METRICS", str(folder / "metrics")), encoding="utf-8")


def lay_out(folder):
    """Lay out the evaluations of a page, its TOML file, and files of somebody else where the page will be."""
    for name in ("paired", "zero", "curves/paired/001000", "curves/paired/002000"):
        path = folder / "metrics" / f"{name}.jsonl"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("".join(json.dumps(line(GRASP, number)) + "\n" for number in range(3)))
        path.with_suffix(".json").write_text(json.dumps(ORIGIN))
    write_rows(folder, toml(ROWS))
    for name in ("thesis.md", "metrics/mine.jsonl", "metrics/mine.json", "metrics/curves/old/000001.jsonl"):
        path = folder / "out" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("three years of work")


def judge(change, folder):
    """Make a page with a change, twice, beside the files of somebody else."""
    lay_out(folder)
    change.apply(folder)
    before = digests(folder)
    for _ in range(2):
        require_right(change, run("report", f"--rows={folder / 'rows.toml'}", f"--out={folder / 'out'}"))
        require_kept(before, digests(folder))


@inputs(few=12)
@given(change=st.one_of(changed_rows(), changed_origins(), changed_videos()))
def test_a_changed_page_is_refused_in_words_or_made(tmp_path_factory, change):
    judge(change, tmp_path_factory.mktemp("page"))


def test_a_page_that_removes_files_of_others_is_found_out(tmp_path, monkeypatch):
    keep = page_files._keep_metrics

    def keep_and_remove(page, stage, folder):
        (folder / "mine.jsonl").unlink(missing_ok=True)
        return keep(page, stage, folder)

    monkeypatch.setattr(page_files, "_keep_metrics", keep_and_remove)
    with pytest.raises(AssertionError, match=r"lost or changed: .*mine\.jsonl"):
        judge(harmless("nothing", lambda folder: None), tmp_path)
