import json
import shutil

import pytest

from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.evaluation.result_page import video_grid
from lerobot_excav.evaluation.result_page.page import make_page
from lerobot_excav.evaluation.result_page.page_files import write_page
from lerobot_excav.evaluation.result_page.page_text import page_text
from lerobot_excav.scripts.main import main

from .conftest import contents


@pytest.fixture
def out(finished, tmp_path):
    """A page that was written."""
    write_page(make_page(finished), tmp_path / "results")
    return tmp_path / "results"


@pytest.fixture
def again(tmp_path):
    """Make the page from the copies of one that was written."""
    return lambda out: make_page(contents(tmp_path, metrics=out / "metrics"))


def test_rows_know_where_they_come_from_and_are_compared_with_the_reference_on_common_scenes(finished):
    (section,) = make_page(finished).sections
    paired, zero = section.rows
    assert (paired["success"].estimate, zero["success"].estimate) == (1.0, 0.0)
    origin = paired.origins["paired"]
    assert origin.commit.startswith("0123")
    training = origin.training
    assert (training.name, training.dataset, training.steps, training.minutes) == ("paired", "pairs", 2000, 20.0)
    assert (training.demonstrations, training.held_out, training.samples) == (200, 40, 32000)
    (difference,) = section.differences
    assert (difference.label, difference.reference, difference.scenes) == ("zero", "paired", 5)
    assert difference.differences[0].difference.estimate == -1.0
    assert difference.differences[0].p_value == pytest.approx(2 / 2**5)


def test_curves_tell_success_by_step_and_minutes(finished):
    (curve,) = make_page(finished).curves
    points = [(p.step, p.minutes, p.n, p.success.estimate, p.scene_set) for p in curve.points]
    assert points == [(1000, 10.0, 4, 0.5, "val"), (2000, 20.0, 4, 1.0, "val")]


def test_the_text_sets_figures_beside_the_papers_and_names_what_was_not_run(finished):
    text = page_text(make_page(finished))
    shown = ["# Does it obey?", "Told before.", "| paired  | correct | 10 | 1     | 100.0 [72.2, 100.0] | 96"]
    shown += ["| 3.0 [3.0, 3.0]", "0 / 0 / 5", "commanded / other / none", "| 200 (40 held out) | 2000  | 16"]
    shown += ["lerobot-eval --policy.path=", "seed 1000, commit 012345678", "lerobot 0.6.1", "Not run: later."]
    assert [words for words in shown if words not in text] == []


def test_a_page_of_nothing_says_so(tmp_path):
    assert "Nothing has been run yet." in page_text(make_page(contents(tmp_path)))


def test_the_page_is_written_with_data_plot_video_and_metrics(out):
    report = json.loads((out / "report.json").read_text())
    row = report["sections"][0]["rows"][0]
    assert row["paper"] == {"success": 96.0, "episode_return": 658.0}
    assert row["origins"]["paired"]["command"].startswith("lerobot-eval")
    assert row["origins"]["paired"]["training"]["steps"] == 2000
    assert report["curves"][0]["points"][0]["minutes"] == 10.0
    lines = [json.loads(line) for line in (out / "rows.jsonl").read_text().splitlines()]
    assert [(line["label"], line["seed"]) for line in lines] == [("paired", 1000), ("zero", 1000)]
    assert (out / "success.png").stat().st_size < 100_000
    assert (out / "rollouts.mp4").stat().st_size < video_grid.MAX_BYTES
    text = (out / "report.md").read_text()
    assert "](success.png)" in text
    assert "](rollouts.mp4)" in text


def test_a_missing_video_leaves_a_tile_out(finished, tmp_path):
    (tmp_path / "test/paired/videos/fr5_grasp_0/eval_episode_0.mp4").unlink()
    (row,) = video_grid.grid_rows(make_page(finished))
    (clip,) = row.clips
    assert clip.path.name == "eval_episode_1.mp4"
    write_page(make_page(finished), tmp_path / "results")
    assert "- `paired`, episodes 1\n" in (tmp_path / "results" / "report.md").read_text()


def test_a_grid_that_shows_more_than_could_be_shown_now_stays_and_the_page_names_what_it_shows(finished, out, tmp_path):
    film, text = (out / "rollouts.mp4").read_bytes(), (out / "report.md").read_text()
    (clips,) = finished.clips
    more = finished.model_copy(update={"clips": (clips, clips.model_copy(update={"label": "zero"}))})
    (tmp_path / "test/paired/videos/fr5_grasp_0/eval_episode_0.mp4").unlink()
    for missing in ("eval_episode_1.mp4", None):
        write_page(make_page(more), out)
        assert (out / "rollouts.mp4").read_bytes() == film
        assert (out / "report.md").read_text() == text
        if missing:
            (tmp_path / "test/paired/videos/fr5_grasp_0" / missing).unlink()


def test_a_grid_is_made_again_when_the_contents_name_other_episodes(finished, out, tmp_path):
    (tmp_path / "test/paired/videos/fr5_grasp_0/eval_episode_0.mp4").unlink()
    (clips,) = finished.clips
    write_page(make_page(finished.model_copy(update={"clips": (clips.model_copy(update={"episodes": (1,)}),)})), out)
    assert "- `paired`, episodes 1\n" in (out / "report.md").read_text()
    (shown,) = json.loads((out / "rollouts.json").read_text())["clips"]
    assert (shown["label"], shown["episodes"]) == ("paired", [1])


@pytest.mark.parametrize("videos_left", [True, False])
def test_a_grid_of_a_row_that_was_played_again_does_not_pass_for_the_new_one(finished, out, tmp_path, videos_left):
    film = (out / "rollouts.mp4").read_bytes()
    metrics = tmp_path / "test/paired/metrics.jsonl"
    metrics.write_text(metrics.read_text().replace('"episode_return": ', '"episode_return": 1'))
    videos = tmp_path / "test/paired/videos/fr5_grasp_0"
    for number in (0,) if videos_left else (0, 1):
        (videos / f"eval_episode_{number}.mp4").unlink()
    write_page(make_page(finished), out)
    told = "episodes 1\n" if videos_left else "episodes 0, 1 of an earlier evaluation\n"
    assert f"- `paired`, {told}" in (out / "report.md").read_text()
    assert ((out / "rollouts.mp4").read_bytes() == film) is not videos_left


@pytest.mark.parametrize("video", [True, False])
def test_a_grid_of_version_0_2_0_is_made_again_of_what_is_there_else_it_is_taken_to_show_what_was_played(
    finished, out, tmp_path, video
):
    listed = json.loads((out / "report_files.json").read_text())
    del listed["files"]["rollouts.json"]
    (out / "report_files.json").write_text(json.dumps(listed))
    (out / "rollouts.json").unlink()
    videos = tmp_path / "test/paired/videos/fr5_grasp_0"
    for number in (0,) if video else (0, 1):
        (videos / f"eval_episode_{number}.mp4").unlink()
    (clips,) = finished.clips
    more = finished.model_copy(update={"clips": (clips, clips.model_copy(update={"label": "later"}))})
    write_page(make_page(more), out)
    text = (out / "report.md").read_text()
    assert f"- `paired`, episodes {'1' if video else '0, 1'}\n" in text
    assert "- `later`" not in text  # it was not played


def test_videos_may_lie_elsewhere_by_the_name_of_their_evaluation(finished, tmp_path):
    shutil.move(tmp_path / "test/paired/videos", tmp_path / "films/paired/videos")
    assert not video_grid.grid_rows(make_page(finished))
    (row,) = video_grid.grid_rows(make_page(finished.model_copy(update={"videos": str(tmp_path / "films")})))
    (clips,) = finished.clips
    assert [clip.path.name for clip in row.clips] == [f"eval_episode_{number}.mp4" for number in clips.episodes]
    assert all(clip.path.is_relative_to(tmp_path / "films") for clip in row.clips)


def test_the_command_says_where_the_videos_lie(finished, tmp_path):
    """In place of what the file says."""
    shutil.move(tmp_path / "test/paired/videos", tmp_path / "films/paired/videos")
    for videos, is_there in (("nowhere", False), ("films", True)):
        out = tmp_path / f"page of {videos}"
        assert (
            main(["report", f"--rows={tmp_path / 'rows.toml'}", f"--videos_folder={tmp_path / videos}", f"--out={out}"])
            == 0
        )
        assert (out / "rollouts.mp4").exists() is is_there


def test_a_page_can_be_made_again_from_its_copies(out, again):
    first = (out / "report.md").read_text()
    write_page(again(out), out)
    assert (out / "report.md").read_text() == first


def test_what_an_earlier_page_was_made_of_does_not_come_back(finished, out, again, tmp_path):
    by_hand = out / "metrics" / "other.jsonl"
    by_hand.write_text("{}")
    shutil.rmtree(tmp_path / "val" / "paired" / "001000")
    shutil.rmtree(tmp_path / "test" / "zero")
    write_page(make_page(finished), out)
    assert [point.step for point in again(out).curves[0].points] == [2000]
    assert again(out).sections[0].missing == ["zero", "later"]
    assert not (out / "metrics" / "zero.json").exists()
    assert by_hand.exists()


@pytest.mark.parametrize(
    "name", ["report.md", "rows.jsonl", "success.png", "metrics/paired.jsonl", "metrics/zero.json"]
)
def test_a_file_of_somebody_else_in_the_place_of_one_is_kept(finished, tmp_path, name):
    mine = tmp_path / "results" / name
    mine.parent.mkdir(parents=True)
    mine.write_text("years of work")
    with pytest.raises(DatasetError, match=rf"{name} was not written by a report; move it elsewhere"):
        write_page(make_page(finished), tmp_path / "results")
    assert [path for path in (tmp_path / "results").rglob("*") if path.is_file()] == [mine]
    assert mine.read_text() == "years of work"


def test_metrics_of_somebody_else_in_the_folder_of_the_copies_are_kept(finished, tmp_path):
    folder = tmp_path / "results" / "metrics"
    (folder / "curves" / "other").mkdir(parents=True)
    mine = [folder / name for name in ("mine.jsonl", "mine.json", "curves/other/1.jsonl", "curves/other/1.json")]
    for path in mine:
        path.write_text("{}")
    write_page(make_page(finished), tmp_path / "results")
    assert all(path.exists() for path in mine)


@pytest.mark.parametrize("label", ["../../thesis", "a/b", "", ".", ".hidden"])
def test_a_label_names_a_file_of_the_page(read_rows, label):
    with pytest.raises(ConfigurationError, match="cannot name a file"):
        read_rows(f'[[section]]\ntitle = "s"\nrows = [{{ label = "{label}", about = "x" }}]')


def test_a_page_made_of_its_copies_removes_none_of_them(out, read_rows):
    before = sorted(out.rglob("*"))
    row = '[[section]]\ntitle = "s"\nrows = [{ label = "paired", about = "x" }]'
    write_page(make_page(read_rows(row, metrics=out / "metrics")), out)
    assert sorted(out.rglob("*")) == before


@pytest.mark.parametrize("key", ["succes", "target_selection"])
def test_a_figure_of_the_paper_without_a_column_is_refused(finished, read_rows, key):
    rows = f'{{ label = "paired", about = "x" }}, {{ label = "later", about = "x", paper = {{ {key} = 9 }} }}'
    page = read_rows(f'[[section]]\ntitle = "s"\nrows = [{rows}]')
    with pytest.raises(ConfigurationError, match=f"'later': paper.{key} has no .* success, episode_return"):
        make_page(page)


def test_a_file_of_several_evaluations_is_told(finished, tmp_path):
    paths = [tmp_path / name / "metrics.jsonl" for name in ("test/zero", "val/paired/001000")]
    for path in paths:
        path.write_text(2 * path.read_text())
    page = make_page(finished)
    assert page.notes == [f"{path} holds 2 evaluations; the last one is used" for path in paths]
    assert f"- {page.notes[0]}.\n" in page_text(page)


@pytest.fixture
def scoop(finished, write_evaluation, scoop_line, tmp_path):
    """Evaluations of the other task, beside those of this one."""
    write_evaluation("test/scoop", [scoop_line(i) for i in range(4)], tmp_path / "gone")
    lines = [scoop_line(i, mask_condition="zero", target_success=False) for i in range(4)]
    write_evaluation("test/scoop-zero", lines, tmp_path / "gone")


@pytest.mark.usefixtures("scoop")
def test_tasks_are_not_mixed_in_a_section(read_rows):
    rows = 'rows = [{ label = "scoop", about = "digs" }, { label = "paired", about = "grasps" }]'
    with pytest.raises(DatasetError, match=r"scoop is of Scoop-v0 and paired of FR5Grasp-v0; report them apart"):
        make_page(read_rows(f'[[section]]\ntitle = "s"\n{rows}'))


@pytest.mark.usefixtures("scoop")
def test_sections_of_different_tasks_are_explained_task_by_task(read_rows):
    page = read_rows(
        '[[section]]\ntitle = "a"\nreference = "scoop"\n'
        'rows = [{ label = "scoop", about = "x" }, { label = "scoop-zero", about = "y" }]\n'
        '[[section]]\ntitle = "b"\nrows = [{ label = "paired", about = "z" }]'
    )
    text = page_text(make_page(page))
    assert "target success [%] minus `scoop`" in text
    assert "-100.0 [-100.0, -30.7]" in text
    assert "- FR5Grasp-v0: Placed: " in text
    assert "efficiency" not in text.lower()  # needs an operator's run, which this page has not


SEEDED = """
[[section]]
title = "a"
reference = "mask"
operator = "operator"
rows = [
  { label = "mask", about = "paired", seeds = [1, 2, 3] },
  { label = "near", about = "non-paired", seeds = [1, 2] },
  { label = "none", about = "no mask", seeds = [1] },
  { label = "operator", about = "operator" },
]
"""


@pytest.fixture
def seeded(write_evaluation, scoop_line, tmp_path, read_rows):
    """A page whose trainings have several seeds, some of which were not run yet."""
    hits = {"mask-1": 19, "mask-2": 20, "near-1": 4, "near-2": 5, "none-1": 8}
    for name, count in hits.items():
        lines = [scoop_line(i, target_success=i < count, retained_mass_kg=300.0) for i in range(20)]
        write_evaluation(f"test/{name}", lines, tmp_path / "gone")
    lines = [scoop_line(i, retained_mass_kg=400.0, operator="scripted") for i in range(20)]
    write_evaluation("test/operator", lines, tmp_path / "gone")
    return read_rows(SEEDED)


def test_seeds_of_a_row_are_one_run_and_those_not_run_are_named(seeded):
    page = make_page(seeded)
    (section,) = page.sections
    assert section.missing == ["mask-3"]
    assert [row.counts["seeds"] for row in section.rows] == [2, 2, 1, 1]
    mask = section.rows[0]
    assert (mask.counts["episodes"], mask["target_success"].estimate) == (40, 39 / 40)
    assert list(mask.origins) == ["mask-1", "mask-2"]
    text = page_text(page)
    assert "Of a single training, so that its intervals do not say how trainings differ: no mask.\n" in text
    table = text.split("\n\n")[2].splitlines()
    cells = [[cell.strip() for cell in line.strip("| ").split("|")] for line in table]
    column = cells[0].index("seeds")
    assert {line[0]: line[column] for line in cells[2:]} == {
        "paired": "2", "non-paired": "2", "no mask": "1", "operator": "-",
    }  # fmt: skip
    assert "Not run: mask-3." in text
    assert "# mask-2, seed " in text


def test_efficiencies_are_related_to_the_operator_of_the_section(seeded):
    page = make_page(seeded)
    assert [row["efficiency"].estimate for row in page.rows] == pytest.approx([0.75, 0.75, 0.75, 1.0])
    text = page_text(page)
    assert "| efficiency [%]" in text
    assert "operator: scripted" in text


def test_p_values_are_corrected_for_the_rows_that_are_compared(seeded):
    (section,) = make_page(seeded).sections
    near, none, operator = (row.differences[0] for row in section.differences)
    p_values = sorted((near.p_value, none.p_value))
    corrected = sorted((near.p_corrected, none.p_corrected))
    assert corrected[0] == pytest.approx(2 * p_values[0])
    assert max(near.p_corrected, none.p_corrected) < 0.01
    assert operator.p_corrected is None  # all are related to it, and it was not chosen among them
    rate = make_page(seeded).rows[0]["target_success"]
    assert rate.low < 0.9  # as twenty scenes allow, though both trainings hit nearly always
    assert rate.high == 1.0


def test_p_values_are_corrected_for_rows_that_are_planned_and_not_run_yet(seeded, tmp_path):
    before = make_page(seeded).sections[0].differences[0].differences[0]
    shutil.rmtree(tmp_path / "test" / "none-1")
    (section,) = make_page(seeded).sections
    near, _ = (row.differences[0] for row in section.differences)
    assert near.p_value == before.p_value
    assert near.p_corrected == pytest.approx(2 * near.p_value)
    assert "those not run yet among them" in page_text(make_page(seeded))


def test_every_measure_that_decides_is_compared_in_a_table_of_its_own(seeded):
    text = page_text(make_page(seeded))
    for measure in ("target success [%]", "full success [%]", "retained [kg]"):
        (header,) = (line for line in text.splitlines() if f"{measure} minus `mask`" in line)
        assert [cell.strip() for cell in header.split("|")[4:6]] == ["scenes", "seeds"]
    for seeds in ("2 vs 2", "1 vs 2", "- vs 2"):
        assert text.count(f"| {seeds} |") == 3


def test_a_row_says_what_its_metrics_cannot_know(seeded, read_rows):
    text = SEEDED.replace('about = "no mask",', 'about = "no mask", setting = { mask = "withheld" },')
    page = make_page(read_rows(text))
    assert [row.setting["mask"] for row in page.rows] == ["correct", "correct", "withheld", "correct"]
    assert page_text(page).count("withheld") == 5  # in each of its tables
    with pytest.raises(ConfigurationError, match=r"'none': setting\.mood has no column; allowed: soil, mask"):
        make_page(read_rows(text.replace("{ mask", "{ mood")))


def test_copies_of_several_seeds_make_the_same_page_again(seeded, tmp_path, read_rows):
    page = make_page(seeded)
    write_page(page, tmp_path / "results")
    again = make_page(read_rows(SEEDED, metrics=tmp_path / "results" / "metrics"))
    assert again.as_dict() == page.as_dict()


def test_the_seed_of_the_bootstrap_has_an_effect(finished, tmp_path, grasp_line, write_evaluation):
    lines = [grasp_line(i, episode_return=float(i * i % 7)) for i in range(9)]
    write_evaluation("test/later", lines, tmp_path / "gone")
    first, second = (make_page(finished, seed=seed).rows[2]["episode_return"] for seed in (0, 5))
    assert first != second


def test_a_row_may_lack_its_checkpoint_or_any_record(finished, tmp_path, grasp_line, write_evaluation):
    write_evaluation("test/later", [grasp_line(0)], tmp_path / "gone")
    origin = make_page(finished).rows[2].origins["later"]
    assert origin.training is None
    assert origin.command.endswith("--seed=1000")
    (tmp_path / "test" / "later" / "metrics.json").unlink()
    assert "Run by hand, without a record of the command: later (seed 0)." in page_text(make_page(finished))


def test_versions_stand_in_a_fixed_order_where_rows_differ(finished, tmp_path):
    path = tmp_path / "test" / "zero" / "metrics.json"
    record = json.loads(path.read_text())
    path.write_text(json.dumps({**record, "packages": {"mujoco": "3.0", "lerobot": "0.6.1"}}))
    text = page_text(make_page(finished))
    assert "- Versions: lerobot 0.6.1, mujoco 3.0; or lerobot 0.6.1, mujoco 4.0.\n" in text
