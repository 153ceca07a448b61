import pytest

from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.report import make_report
from lerobot_excav.evaluation.report_text import report_text

NOTHING = {"is_success": False, "target_in_tray": False, "blocks_in_tray": 0, "episode_return": 0.0}


@pytest.fixture
def lines(grasp_line):
    """Four successes, two dropped blocks, three wrong ones and one hand that grasped none."""
    return [
        *(grasp_line(i) for i in range(4)),
        *(grasp_line(i, **{**NOTHING, "episode_return": 50.0}) for i in (4, 5)),
        *(grasp_line(i, **NOTHING, first_grasped_block=(i + 1) % 4) for i in (6, 7, 8)),
        grasp_line(9, **NOTHING, first_grasped_block=-1),
    ]


def test_target_selection_is_told_apart_from_success(make_run, lines):
    (row,) = make_report([make_run("a", lines)]).runs
    assert row["success"].estimate == 0.4
    assert row["episode_return"].estimate == pytest.approx(330.0)
    assert row["grasped"].estimate == 0.9
    assert (row["target_selection"].estimate, row["target_selection"].n) == (pytest.approx(6 / 9), 9)
    assert (row["placed"].estimate, row["placed"].n) == (pytest.approx(4 / 6), 6)
    assert row["first_grasped"] == {"commanded": 6, "other": 3, "none": 1}


def test_the_text_shows_rates_with_what_they_are_of(make_run, lines):
    text = report_text(make_report([make_run("a", lines)]))
    assert "40.0 [16.8, 68.7]" in text
    assert "66.7 [35.4, 87.9] of 9" in text
    assert "6 / 3 / 1" in text
    assert "commanded / other / none" in text
    assert "kg" not in text


def test_following_a_wrong_mask_is_told_apart_from_the_command(make_run, grasp_line):
    wrong = {**NOTHING, "mask_condition": "mismatched"}
    lines = [
        *(grasp_line(i, **wrong, shown_block=(i + 1) % 4, first_grasped_block=(i + 1) % 4) for i in range(3)),
        grasp_line(3, **wrong, shown_block=0, first_grasped_block=3),
        grasp_line(4, **wrong, shown_block=1, first_grasped_block=-1),
    ]
    (row,) = make_report([make_run("a", lines)]).runs
    assert (row["mask_followed"].estimate, row["mask_followed"].n) == (0.75, 4)
    assert row["target_selection"].estimate == 0.25


def test_a_mask_without_a_block_cannot_be_followed(make_run, grasp_line):
    lines = [grasp_line(0, mask_condition="zero", shown_block=-1)]
    (row,) = make_report([make_run("a", lines)]).runs
    assert row["mask_followed"] is None


def test_nothing_grasped_leaves_selection_open(make_run, grasp_line):
    (row,) = make_report([make_run("a", [grasp_line(0, first_grasped_block=-1)])]).runs
    assert row["target_selection"] is None
    assert row["placed"] is None
    assert "| -" in report_text(make_report([make_run("b", [grasp_line(0, first_grasped_block=-1)])]))


def test_after_a_change_of_the_command_the_last_one_counts(make_run, grasp_line):
    changed = {"retarget_frame": 25, "final_target_id": 3}
    lines = [
        grasp_line(0, **changed, first_grasped_block=3),
        grasp_line(1, **changed, first_grasped_block=1),
    ]
    (row,) = make_report([make_run("a", lines)]).runs
    assert row["first_grasped"] == {"commanded": 1, "other": 1, "none": 0}
    assert row.setting == {"mask": "correct, changed at frame 25"}


def test_noise_is_part_of_the_mask(make_run, grasp_line):
    (row,) = make_report([make_run("a", [grasp_line(0, mask_noise="shift", mask_noise_px=4)])]).runs
    assert row.setting == {"mask": "correct, shift 4 px"}


@pytest.mark.parametrize(
    "changes",
    [{"mask_noise": "erode"}, {"mask_noise_px": 2}, {"retarget_frame": 9}, {"mask_condition": "zero"}],
)
def test_a_run_does_not_mix_masks(make_run, grasp_line, changes):
    with pytest.raises(ConfigurationError, match="a mixes mask conditions, kinds of mask noise"):
        make_run("a", [grasp_line(0), grasp_line(1, **changes)])


def test_runs_on_the_same_scenes_are_compared_by_success_and_return(make_run, lines, grasp_line):
    perfect = make_run("perfect", [grasp_line(i) for i in range(10)])
    report = make_report([make_run("a", lines), perfect])
    success, total = report.differences["perfect - a"]
    assert success.difference.estimate == pytest.approx(0.6)
    assert success.p_value == pytest.approx(2 / 2**6)
    assert total.difference.estimate == pytest.approx(470.0)
    assert "| success [%] | +60.0" in report_text(report)


def test_tasks_are_not_mixed(make_run, grasp_line, metrics_line, metrics_file):
    digging, grasping = make_run("d", [metrics_line(0)]), make_run("g", [grasp_line(0)])
    with pytest.raises(DatasetError, match=r"d is of Scoop-v0 and g of FR5Grasp-v0"):
        make_report([digging, grasping])
    with pytest.raises(DatasetError, match=r":2: task='Scoop-v0', but the lines before"):
        read_evaluation(metrics_file("m.jsonl", [grasp_line(0), metrics_line(1)]))


def test_the_json_keeps_settings_and_counts(make_run, lines):
    (row,) = make_report([make_run("a", lines)]).as_dict()["runs"]
    assert row["task"] == "FR5Grasp-v0"
    assert row["mask_noise"] == "none"
    assert row["first_grasped"] == {"commanded": 6, "other": 3, "none": 1}
    assert row["target_selection"]["n"] == 9
    assert "n" not in row["success"]


def test_a_run_can_be_cut_to_some_scenes(make_run, lines):
    run = make_run("a", lines)
    assert len(run.only(run.keys[:3]).episodes) == 3
